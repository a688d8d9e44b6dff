// The stop of a service's page, whichever view is shown, and also before the view is loaded.
import { button, clear, press, settle, show, text } from "./shown";
import { memberOf } from "./members";
import { remoteOf } from "./remotes";
import { Store } from "../../web/src/app/store";
import { ServicePage } from "../../web/src/pages/service_page";
import type { ServicePageProps } from "../../web/src/pages/service_page";

/** The code of the board, on its way. */
const way = vi.hoisted(() => {
  let arrive!: () => void;
  const arrived = new Promise<void>((resolve) => (arrive = resolve));
  return { arrived, arrive };
});
const means = vi.hoisted((): { link: unknown } => ({ link: null }));

vi.mock("../../web/src/board/board_page", async () => {
  await way.arrived;
  return { default: () => "the board, with its own stop" };
});
vi.mock("../../web/src/gateway/link_to", () => ({
  linkTo: () => ({ link: means.link, dispose: () => undefined }),
}));
afterEach(clear);

test("a board whose code is on its way has the stop of the page, until it has its own", async () => {
  const remote = remoteOf([memberOf("function", "void", "halt")]);
  means.link = { state: new Store({ kind: "online", since: 0, remote }), retryNow: () => undefined };
  const services = [{ name: "s", type: "a.b.Robot" }];
  const list = {
    state: new Store({ kind: "known", devices: [{ name: "d", services, safe: [], mode: "shared", state: "online" }] }),
  };
  const route = { page: "service", device: "d", service: "s", path: [], view: "board", board: null };
  show(ServicePage, { route, list, onlyStop: false } as unknown as ServicePageProps);
  await settle();
  expect(text()).not.toContain("the board");
  expect(text()).toContain("calls halt()");
  await press("Stop");
  expect(remote.urgent).toHaveBeenCalledWith("halt", [], expect.anything());
  way.arrive();
  await vi.waitFor(() => expect(text()).toContain("the board, with its own stop"));
  expect(() => button("Stop")).toThrow("0 buttons");
});
