// Requests of access, as they are shown to who decides on them.
import { Store } from "../../web/src/app/store";
import { AccessDesk } from "../../web/src/gateway/access";
import type { Who } from "../../web/src/gateway/session";
import { AccessPart } from "../../web/src/pages/access_part";
import { clear, find, press, settle, show, text } from "./shown";

const admin: Who = { user: "root", roles: ["admin"], login: true, session: true, requests: false, admin: true };
const requestOf = (id: string) => ({ id, name: id, reason: "", client: "10.0.0.5", state: "pending" });
const answer = (...ids: string[]) => new Response(JSON.stringify({ requests: ids.map(requestOf) }));

let now = 10_000;
let waiting: string[] = [];
let asked: string[] = [];
let who: Store<Who | null>;

function start(): AccessDesk {
  who = new Store<Who | null>(null);
  asked = [];
  const fetch = (path: string, init?: RequestInit): Promise<Response> => {
    if (init?.method !== "POST") return Promise.resolve(answer(...waiting));
    asked.push(path.split("requests/")[1] ?? "");
    waiting = waiting.slice(1);
    return Promise.resolve(new Response("{}"));
  };
  const desk = new AccessDesk({ fetch, who });
  who.value = admin;
  return desk;
}

beforeEach(() => void vi.spyOn(performance, "now").mockImplementation(() => now));
afterEach(() => {
  clear();
  vi.restoreAllMocks();
});

describe("a request of access", () => {
  test.each(["Approve", "Deny"])("is not answered by the second click on another one's %s", async (name) => {
    waiting = ["ann", "bob"];
    const access = start();
    show(AccessPart, { access });
    await settle();
    const pressFirst = async (): Promise<void> => {
      const first = find("[data-request]");
      const button = [...first.querySelectorAll("button")].find((each) => each.textContent === name);
      for (const kind of ["pointerdown", "click"])
        button?.dispatchEvent(new MouseEvent(kind, { bubbles: true, cancelable: true, detail: 1 }));
      await settle();
    };
    await pressFirst(); // it has just appeared
    expect(asked).toEqual([]);
    now += 1_000;
    await pressFirst();
    await pressFirst();
    expect(asked).toEqual([`ann/${name.toLowerCase()}`]);
    expect(text()).toContain("bob");
    now += 1_000;
    await press(name);
    expect(asked[1]).toBe(`bob/${name.toLowerCase()}`);
  });

  test("is approved by Enter in the field of roles", async () => {
    waiting = ["ann"];
    const access = start();
    show(AccessPart, { access });
    await settle();
    now += 1_000;
    const form = find<HTMLFormElement>("form");
    expect(form.querySelector("button")?.type).toBe("submit"); // a browser clicks it then
    await press("Approve");
    expect(asked).toEqual(["ann/approve"]);
  });

  test("is not shown to the next user, however late the answer comes", async () => {
    waiting = ["ann"];
    const access = start();
    who.value = { ...admin, user: "guest", admin: false };
    await settle();
    expect(access.pending.value).toEqual([]);
    who.value = admin;
    await settle();
    expect(access.pending.value).toHaveLength(1);
  });
});
