"""/v1/layouts/evaluate: how good is this layout?"""

from __future__ import annotations

import json

from fastapi import APIRouter
from fastapi.responses import Response

from duocell.service.api.bodies import JsonBody
from duocell.service.api.ownership import OwnView
from duocell.service.api.state import StateOf
from duocell.service.http.described import answer, json_body_of, problems
from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE, EvaluateRequest, Evaluation

router = APIRouter(prefix="/v1/layouts", tags=["layouts"])


@router.post(
    "/evaluate",
    operation_id="evaluate_layout",
    summary="Evaluate a given layout",
    response_model=Evaluation,
    responses={
        200: answer("How good it is, and every rule that it breaks."),
        **problems(400, 413, 415, 422, 429, 500, 503),
    },
    openapi_extra=json_body_of(EvaluateRequest, "The task, the arms, and where their bases stand.", EVALUATE_EXAMPLE),
)
async def evaluate_layout(body: JsonBody, view: OwnView, state: StateOf) -> Response:
    """Score and verify a layout without optimising: every base stands where the request says.

    Without joints the best path of the best posture from there is found; with joints these are checked as they are.
    Nothing is stored. A layout that breaks a rule is an answer (`outcome: infeasible` with reasons), not an error.
    """
    accepted = await state.acceptance.evaluation(body, view)
    answer = await state.evaluations.evaluate(accepted)
    name = json.dumps(accepted.name, ensure_ascii=False)
    text = f'{{"name":{name},"request":{accepted.text},"result":{answer.text}}}'
    return Response(text, media_type="application/json")
