// The life of a job in TypeScript, with types made from docs/openapi.json: compiled strictly, then run against a server.
import createClient from "openapi-fetch";
import type { components, paths } from "./schema.js";

declare const process: { argv: string[] };

type LayoutRequest = components["schemas"]["LayoutRequest"];
type Layout = components["schemas"]["Layout"];

const standing = { rpy: [0, Math.PI, 0] };
const request: LayoutRequest = {
  name: "typescript",
  task: {
    line: {
      start: { position: [0.5, -0.1, 0.1], orientation: standing },
      end: { position: [0.5, 0.1, 0.1], orientation: standing },
      count: 3,
    },
  },
  arms: [
    {
      name: "arm",
      robot: "puma560",
      grasp: { position: [0, 0, 0], orientation: { quaternion: [0, 0, 0, 1] } },
      base: { x: [-0.2, 0.2], y: [-0.2, 0.2], z: 0, yaw: 0 },
    },
  ],
};

// The types must know what is wrong; a line without its error fails the compilation.
// @ts-expect-error a request needs arms
const withoutArms: LayoutRequest = { task: request.task };
// @ts-expect-error this is no state of a layout
const status: Layout["status"] = "finished";
// @ts-expect-error an outcome is one of three words
const outcome: components["schemas"]["LayoutResult"]["outcome"] = "good";

function expect(condition: boolean, what: string): asserts condition {
  if (!condition) throw new Error(what);
}

const client = createClient<paths>({ baseUrl: process.argv[2]!, headers: { "X-API-Key": process.argv[3]! } });

const created = await client.POST("/v1/layouts", { body: request });
expect(created.response.status === 202, `status ${created.response.status}`);
expect(created.data !== undefined, "no layout");
let layout: Layout = created.data;
while (layout.status === "queued" || layout.status === "running") {
  await new Promise((resolve) => setTimeout(resolve, 50));
  const { data } = await client.GET("/v1/layouts/{layout_id}", { params: { path: { layout_id: layout.id } } });
  expect(data !== undefined, "the layout is gone");
  layout = data;
}
expect(layout.status === "succeeded" && layout.result !== null, JSON.stringify(layout.error));
const arm = layout.result.arms[0];
expect(arm !== undefined && arm.joints.length === 3, "three poses, three rows of joints");

const { data: page } = await client.GET("/v1/layouts", { params: { query: { limit: 1 } } });
expect(page?.items[0]?.id === layout.id, "the newest comes first");

request.arms[0]!.robot = "pumma560";
const refused = await client.POST("/v1/layouts", { body: request });
expect(refused.data === undefined && refused.error.code === "unknown-robot", "a typed problem");
expect(refused.error.errors[0]?.pointer === "/arms/0/robot", "with the place");

console.log(`${arm.name} ${arm.base.position.map((value) => value.toFixed(3)).join(" ")} ${layout.result.outcome}`);
