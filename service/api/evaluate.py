"""/v1/layouts/evaluate: how good is this layout?"""

from __future__ import annotations

import json

from fastapi import APIRouter, Request
from fastapi.responses import Response

from duocell.service.api.ownership import view_of
from duocell.service.api.state import StateOf
from duocell.service.http.body import json_body
from duocell.service.schemas.evaluate import Evaluation
from duocell.service.schemas.resources import ProblemDocument

router = APIRouter(prefix="/v1/layouts", tags=["layouts"])

PROBLEM = {"model": ProblemDocument}


@router.post(
    "/evaluate",
    operation_id="evaluate_layout",
    summary="Evaluate a given layout",
    response_model=None,
    responses={
        200: {"model": Evaluation, "description": "How good it is, and every rule that it breaks."},
        **dict.fromkeys((400, 413, 415, 422, 429, 500, 503), PROBLEM),
    },
)
async def evaluate_layout(request: Request, state: StateOf) -> Response:
    """Score and verify a layout without optimising: every base stands where the request says.

    Without joints the best path of the best posture from there is found; with joints these are checked as they are.
    Nothing is stored. A layout that breaks a rule is an answer (`outcome: infeasible` with reasons), not an error.
    """
    body = await json_body(request, state.settings.max_body)
    accepted = await state.acceptance.evaluation(body, view_of(request, state))
    answer = await state.evaluations.evaluate(accepted)
    name = json.dumps(accepted.name, ensure_ascii=False)
    text = f'{{"name":{name},"request":{accepted.text},"result":{answer.text}}}'
    return Response(text, media_type="application/json")
