// A page that asks a gateway again and again: by a clock that tests set forward, with answers that they give.
interface Polled {
  start(): void;
  stop(): void;
}

export interface PolledPage {
  /** What each next request gets; with none left, the gateway is away. */
  answers: (Response | Error)[];
  /** Addresses of what was asked. */
  asked: string[];
  hidden: boolean;
  /** As after a change of `hidden`, while something asks. */
  look: () => void;
}

/** For each test of a `describe`. Requests of paths that end otherwise than with `end` are not noted, and fail. */
export function polledPage(end = ""): PolledPage {
  const page: PolledPage = { answers: [], asked: [], hidden: false, look: () => undefined };
  beforeEach(() => {
    vi.useFakeTimers();
    page.answers.length = page.asked.length = 0;
    page.hidden = false;
    page.look = () => undefined;
    vi.stubGlobal("document", {
      baseURI: "https://host/robots/",
      get hidden() {
        return page.hidden;
      },
      addEventListener: (_: string, listener: () => void) => (page.look = listener),
      removeEventListener: () => (page.look = () => undefined),
    });
    vi.stubGlobal("fetch", async (url: URL) => {
      if (!url.pathname.endsWith(end)) throw new TypeError("fetch failed");
      page.asked.push(url.href);
      const answer = page.answers.shift() ?? new TypeError("fetch failed");
      if (answer instanceof Error) throw answer;
      return answer;
    });
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });
  return page;
}

/** A test: `list` asks nothing while the page is hidden. */
export function restsWhileHidden(page: PolledPage, list: () => Polled): void {
  it("is not asked for while the page is hidden, and at once when it is shown", async () => {
    const polled = list();
    page.hidden = true;
    polled.start();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(page.asked.length).toBe(1);
    page.hidden = false;
    page.look();
    await vi.advanceTimersByTimeAsync(0);
    expect(page.asked.length).toBe(2);
    polled.stop();
  });
}
