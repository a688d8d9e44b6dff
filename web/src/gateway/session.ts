// Who this page is to the gateway: signing in and out, and what its requests and connections show.
// Layer: web/gateway. Source: GET /api/v1/access, POST and DELETE /api/v1/session, POST /api/v1/tickets.

import { t } from "../app/language";
import { Store } from "../app/store";
import { expectOk } from "./answer";

export interface Who {
  /** null: the page has shown nothing. */
  user: string | null;
  roles: string[];
  /** Whether the gateway asks who one is at all. */
  login: boolean;
  /** Whether it is a sign-in here that says who, so that one can sign out. */
  session: boolean;
  /** Whether one may ask for access. */
  requests: boolean;
  /** Whether this user decides on requests. */
  admin: boolean;
}

const POLL_MS = 5_000;
const DEADLINE_MS = 10_000;

export class Session {
  readonly who = new Store<Who | null>(null);
  /** Why a sign-in that was good is not any more. */
  readonly trouble = new Store<string | null>(null);
  #known: Promise<void> = Promise.resolve();
  #asked = 0;

  /** @returns once the gateway has said who the page is, or could not. */
  start(): Promise<void> {
    this.#known = this.#look();
    void this.#known.then(() => this.#lookAgain());
    return this.#known;
  }

  /**
   * `name` "": `secret` is a token. It is kept nowhere: the gateway gives a cookie that no script can read.
   *
   * @throws Error with what is wrong, for people.
   */
  async signIn(name: string, secret: string): Promise<void> {
    const body = JSON.stringify(proofOf(name, secret));
    const init = { method: "POST", headers: { ["Content-Type"]: "application/json" }, body };
    const response = await this.#ask("api/v1/session", init).catch((error: unknown) => {
      throw new Error(t("The gateway does not answer ({0}).", (error as Error).message));
    });
    if (response.status === 401)
      throw new Error(name === "" ? t("This token is not valid.") : t("Wrong name or password."));
    await expectOk(response);
    this.trouble.value = null;
    await this.#look();
  }

  /** @throws Error: the gateway could not be told. */
  async signOut(): Promise<void> {
    const response = await this.#ask("api/v1/session", { method: "DELETE" });
    await expectOk(response);
    this.trouble.value = null;
    // What the browser shows by itself, or nothing: until the gateway says so, nothing.
    if (this.who.value) this.who.value = { ...this.who.value, user: null, roles: [], session: false, admin: false };
    await this.#look();
  }

  /** As fetch(), of a path of the gateway. A refusal never opens the browser's own dialog. */
  async fetch(path: string, init: RequestInit = {}): Promise<Response> {
    await this.#known;
    const who = this.who.value;
    const isOfBrowser = who !== null && !isSignedOut(who);
    const response = await fetch(address(path), ofPage(init, isOfBrowser));
    if (response.status === 401) void this.#look();
    return response;
  }

  /** The same URL of a WebSocket, with a ticket where the gateway knows who the page is. @throws Error */
  async withTicket(url: string): Promise<string> {
    await this.#known;
    if (!this.who.value?.login || this.who.value.user === null) return url;
    const response = await this.fetch("api/v1/tickets", { method: "POST" });
    await expectOk(response);
    const { ticket } = (await response.json()) as { ticket: string };
    return `${url}&${new URLSearchParams({ ticket }).toString()}`;
  }

  /** These requests are answered whoever asks, so that the browser may show what it has. */
  #ask(path: string, init: RequestInit = {}): Promise<Response> {
    return fetch(address(path), ofPage({ ...init, signal: AbortSignal.timeout(DEADLINE_MS) }, true));
  }

  async #look(): Promise<void> {
    const asked = ++this.#asked;
    try {
      const response = await this.#ask("api/v1/access?devices=false");
      const answer: unknown = response.ok ? await response.json() : {};
      if (asked !== this.#asked) return; // asked again meanwhile, or signed in or out
      if (response.ok) this.#take(readWho(answer));
      else if (response.status === 404) this.#take(readWho({})); // an older gateway, which asks nobody
    } catch {
      // The list of devices tells that the gateway is away.
    }
  }

  #take(who: Who): void {
    const hasEnded = this.who.value?.session === true && who.user === null;
    if (hasEnded) this.trouble.value = t("The gateway no longer accepts this sign-in.");
    if (JSON.stringify(who) !== JSON.stringify(this.who.value)) this.who.value = who;
  }

  #lookAgain(): void {
    // A gateway that lets everybody in need not be asked again.
    if (this.who.value?.login === false) return;
    setTimeout(() => void this.#look().then(() => this.#lookAgain()), POLL_MS);
  }
}

export const session = new Session();

/** Whether there is nothing to see without signing in. */
export function mustSignIn(who: Who | null): boolean {
  return isSignedOut(who) && who?.roles.length === 0;
}

/** Whether the gateway wants to know who the page is, and does not. */
export function isSignedOut(who: Who | null): boolean {
  return who !== null && who.login && who.user === null;
}

export function readWho(answer: unknown): Who {
  const given = (answer ?? {}) as Record<string, unknown>;
  const { user, roles } = given;
  return {
    user: typeof user === "string" ? user : null,
    roles: Array.isArray(roles) ? roles.filter((role) => typeof role === "string") : [],
    login: given["login"] === true,
    session: given["session"] === true,
    requests: given["requests"] === true,
    admin: given["admin"] === true,
  };
}

/** @throws Error: the protocol has no place for this name. */
export function proofOf(name: string, secret: string): Record<string, string> {
  if (name.includes(":")) throw new Error(t("A name has no colon."));
  return name === "" ? { token: secret.trim() } : { user: name, password: secret };
}

/** X-Requested-With: the page has a form, so no browser's dialog is wanted. */
function ofPage(init: RequestInit, isOfBrowser: boolean): RequestInit {
  const headers = new Headers(init.headers);
  headers.set("X-Requested-With", "rrgate");
  return { ...init, headers, cache: "no-store", credentials: isOfBrowser ? "same-origin" : "omit" };
}

function address(path: string): URL {
  return new URL(path, document.baseURI);
}
