// Addresses of requests, messages of event streams, routes and the query string.

import assert from "node:assert/strict";
import { test } from "node:test";

import { address } from "../../labctl/web/static/js/core/http/address.js";
import { parseMessage, splitMessages } from "../../labctl/web/static/js/core/http/event_message.js";
import { changedQuery, matchRoute, routeOf } from "../../labctl/web/static/js/core/routes.js";

test("parameters of a path are encoded, and none may lack", () => {
  assert.equal(address("/api/units/{serial}/ladder", { serial: "A/1 ä" }), "/api/units/A%2F1%20%C3%A4/ladder");
  assert.equal(address("/api/campaigns/{campaign}", { campaign: 3 }), "/api/campaigns/3");
  assert.throws(() => address("/api/units/{serial}", {}), /lacks its serial/);
});

test("a query repeats lists and leaves out what is not there", () => {
  const query = { recording: 3, formula: ["a", "b"], from_s: null, until_s: undefined, channel: "", points: false };
  assert.equal(address("/api/x", {}, query), "/api/x?recording=3&formula=a&formula=b&points=false");
  assert.equal(address("/api/x", {}, { from_s: null }), "/api/x");
});

test("a message of an event stream has its event, id and data", () => {
  assert.deepEqual(parseMessage('id: 7\nevent: progress\ndata: {"t_s": 1}'), {
    event: "progress",
    id: 7,
    data: { t_s: 1 },
  });
  assert.deepEqual(parseMessage('data: {"a": ": "}'), { event: "message", id: null, data: { a: ": " } });
  assert.equal(parseMessage(": keep-alive").event, "alive");
});

test("an event stream is cut at empty lines, whatever ends a line", () => {
  assert.deepEqual(splitMessages("a\n\nb\r\n\r\nc"), { messages: ["a", "b"], rest: "c" });
  assert.deepEqual(splitMessages("a\n"), { messages: [], rest: "a\n" });
});

const load = async () => ({ page: () => /** @type {any} */ (null) });
const routes = ["/", "/campaigns/new", "/campaigns/:id", "/units/:serial"].map((path) => routeOf(path, "A page", load));

test("the first route that fits is taken, with its decoded parameters", () => {
  assert.deepEqual(matchRoute(routes, "/")?.params, {});
  assert.deepEqual(matchRoute(routes, "/campaigns/new")?.params, {});
  assert.deepEqual(matchRoute(routes, "/campaigns/%E0%A4%A")?.params, { id: "%E0%A4%A" }); // no text: as it stands
  assert.deepEqual(matchRoute(routes, "/campaigns/12")?.params, { id: "12" });
  assert.deepEqual(matchRoute(routes, "/units/A%2F1/")?.params, { serial: "A/1" });
  assert.equal(matchRoute(routes, "/campaigns"), null);
  assert.equal(matchRoute(routes, "/units/A/B"), null);
});

test("a change of the query keeps the rest and removes what is empty", () => {
  assert.equal(changedQuery("?unit=A&axis=z", { axis: null, view: "rest" }), "unit=A&view=rest");
  assert.equal(changedQuery("?axis=z", { axis: "" }), "");
  assert.equal(changedQuery("", { version: 2, recording: undefined }), "version=2");
});
