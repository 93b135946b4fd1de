"""Write the OpenAPI document that clients are made from: `make openapi`.

python .ci/write_openapi.py docs/openapi.json
"""

import json
import sys
from pathlib import Path

from duocell.service.app import create_app
from duocell.service.settings import Settings


def main() -> None:
    """Write it as the service publishes it, indented, so that a change can be read."""
    document = create_app(Settings()).openapi()
    Path(sys.argv[1]).write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
