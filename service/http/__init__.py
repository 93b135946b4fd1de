"""What HTTP needs beside the endpoints: bodies, headers, keys, rates, problem documents, the OpenAPI document."""
