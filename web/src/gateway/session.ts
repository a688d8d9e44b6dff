// Who this page is to the gateway: signing in and out, and what its requests and connections show.
// Layer: web/gateway. Source: GET /api/v1/access, POST /api/v1/tickets.

import { Store } from "../app/store";

export interface Who {
  /** null: the page has shown nothing. */
  user: string | null;
  roles: string[];
  /** Whether the gateway asks who one is at all. */
  login: boolean;
  /** Whether one may ask for access. */
  requests: boolean;
  /** Whether this user decides on requests. */
  admin: boolean;
}

const POLL_MS = 5_000;
const DEADLINE_MS = 10_000;
const KEY = "rrgate-proof";

export class Session {
  readonly who = new Store<Who | null>(null);
  /** Why a sign-in that was good is not any more. */
  readonly trouble = new Store<string | null>(null);
  /** The header that signing in has made; of this tab alone. null: the browser shows what it has, cookies for example. */
  readonly proof = new Store<string | null>(readProof());
  #known: Promise<void> = Promise.resolve();

  constructor() {
    this.proof.watch(keepProof);
  }

  /** @returns once the gateway has said who the page is, or could not. */
  start(): Promise<void> {
    this.#known = this.#look();
    void this.#known.then(() => this.#lookAgain());
    return this.#known;
  }

  /** `name` "": `secret` is a token. @throws Error with what is wrong, for people. */
  async signIn(name: string, secret: string): Promise<void> {
    const proof = formatProof(name, secret);
    const response = await this.#ask(proof).catch((error: unknown) => {
      throw new Error(`The gateway does not answer (${(error as Error).message}).`);
    });
    if (response.status === 401) throw new Error(name === "" ? "This token is not valid." : "Wrong name or password.");
    if (!response.ok) throw new Error(await problemOf(response));
    const who = readWho(await response.json());
    if (who.login && who.user === null)
      throw new Error("The gateway takes no passwords here. Leave the name empty to show a token.");
    this.trouble.value = null;
    this.proof.value = proof;
    this.who.value = who;
  }

  signOut(why: string | null = null): Promise<void> {
    const before = this.who.value;
    this.proof.value = null;
    this.trouble.value = why;
    // What the browser shows by itself, or nothing: until the gateway says so, nothing.
    if (before) this.who.value = { ...before, user: null, roles: [], admin: false };
    return this.#look();
  }

  /** As fetch(), of a path of the gateway. A refusal never opens the browser's own dialog. */
  async fetch(path: string, init: RequestInit = {}): Promise<Response> {
    await this.#known;
    const who = this.who.value;
    const isOfBrowser = who !== null && !(who.login && who.user === null);
    const response = await fetch(address(path), withProof(init, this.proof.value, isOfBrowser));
    if (response.status === 401) void this.#look();
    return response;
  }

  /** The same URL of a WebSocket, with a ticket where the gateway knows who the page is. @throws Error */
  async withTicket(url: string): Promise<string> {
    await this.#known;
    if (!this.who.value?.login || this.who.value.user === null) return url;
    const response = await this.fetch("api/v1/tickets", { method: "POST" });
    if (!response.ok) throw new Error(await problemOf(response));
    const { ticket } = (await response.json()) as { ticket: string };
    return `${url}&${new URLSearchParams({ ticket }).toString()}`;
  }

  /** This one request is answered whoever asks, so that the browser may show what it has. */
  #ask(proof: string | null): Promise<Response> {
    const signal = AbortSignal.timeout(DEADLINE_MS);
    return fetch(address("api/v1/access"), withProof({ signal }, proof, true));
  }

  async #look(): Promise<void> {
    const proof = this.proof.value;
    try {
      const response = await this.#ask(proof);
      const answer: unknown = response.ok ? await response.json() : {};
      if (proof !== this.proof.value) return; // signed in or out meanwhile
      if (response.ok) this.#take(readWho(answer));
      else if (response.status === 401 && proof !== null)
        await this.signOut("The gateway no longer accepts this sign-in.");
      else if (response.status === 404) this.#take(readWho({})); // an older gateway, which asks nobody
    } catch {
      // The list of devices tells that the gateway is away.
    }
  }

  #take(who: Who): void {
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
  return who !== null && who.login && who.user === null && who.roles.length === 0;
}

export function readWho(answer: unknown): Who {
  const given = (answer ?? {}) as Record<string, unknown>;
  const { user, roles } = given;
  return {
    user: typeof user === "string" ? user : null,
    roles: Array.isArray(roles) ? roles.filter((role) => typeof role === "string") : [],
    login: given["login"] === true,
    requests: given["requests"] === true,
    admin: given["admin"] === true,
  };
}

/** @throws Error: the protocol has no place for this name. */
export function formatProof(name: string, secret: string): string {
  if (name === "") return `Bearer ${secret.trim()}`;
  if (name.includes(":")) throw new Error("A name has no colon.");
  const bytes = new TextEncoder().encode(`${name}:${secret}`);
  return `Basic ${btoa(String.fromCharCode(...bytes))}`;
}

/** What the gateway said about a request that it refused. */
export async function problemOf(response: Response): Promise<string> {
  const problem = (await response.json().catch(() => null)) as { detail?: unknown } | null;
  return typeof problem?.detail === "string" ? problem.detail : `the gateway answered ${response.status}`;
}

function withProof(init: RequestInit, proof: string | null, isOfBrowser: boolean): RequestInit {
  const headers = new Headers(init.headers);
  if (proof !== null) headers.set("Authorization", proof);
  return { ...init, headers, cache: "no-store", credentials: proof === null && isOfBrowser ? "same-origin" : "omit" };
}

function address(path: string): URL {
  return new URL(path, document.baseURI);
}

function readProof(): string | null {
  try {
    return sessionStorage.getItem(KEY);
  } catch {
    return null; // as below
  }
}

function keepProof(proof: string | null): void {
  try {
    if (proof === null) sessionStorage.removeItem(KEY);
    else sessionStorage.setItem(KEY, proof);
  } catch {
    // Storage may be forbidden; the sign-in then lasts as long as the page.
  }
}
