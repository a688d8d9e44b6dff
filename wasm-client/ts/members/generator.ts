// Generator functions: results that come one after another. Layer: wasm-client/ts/members.
// Source: sessions spec section 2.10.
import { asyncDispose } from "../dispose.js";
import { ErrorCode, makeError, RobotRaconteurError } from "../errors.js";
import type { CallOptions, MemberInfo, RrValue } from "../types.js";
import type { GeneratorStep } from "../wasm_module.js";
import { checkSignal, within } from "../within.js";
import { signature, splitArguments } from "./member.js";
import type { MemberContext } from "./member.js";

const suffix = "{generator}";

export function isGenerator({ type, parameters }: MemberInfo): boolean {
  return type.endsWith(suffix) || takesValues({ parameters });
}

function takesValues({ parameters }: Pick<MemberInfo, "parameters">): boolean {
  return parameters.at(-1)?.type.endsWith(suffix) ?? false;
}

type Result = IteratorResult<RrValue | undefined, undefined>;

export function makeGeneratorFunction(context: MemberContext): (...args: unknown[]) => Generator {
  const count = context.info.parameters.length - (takesValues(context.info) ? 1 : 0);
  const call = (...args: unknown[]) => {
    const { values, options } = splitArguments(signature(context.info), count, args);
    return new Generator(context, values, options);
  };
  return Object.defineProperty(call, "name", { value: context.info.name });
}

/**
 * One run. The service hears of it with the first next(); steps follow one another, however they are asked for. Its end
 * waits for none of them, nor for what else is to be sent.
 */
class Generator implements AsyncGenerator<RrValue | undefined, undefined, unknown> {
  /** Its index, once the service was asked for it. */
  #opened: Promise<number> | undefined;
  #isDone = false;
  /** Whether the core took the last step. */
  #isSent = false;
  /** The step before. */
  #last: Promise<unknown> = Promise.resolve();
  /** Rejects the step under way. */
  #interrupt: ((reason: unknown) => void) | undefined;
  /** What became of closing or aborting it. */
  #ending: Promise<void> | undefined;

  constructor(
    private readonly context: MemberContext,
    private readonly args: readonly unknown[],
    private readonly options: CallOptions,
  ) {}

  [Symbol.asyncIterator](): this {
    return this;
  }

  next(parameter?: unknown): Promise<Result> {
    const result = this.#last.then(
      () =>
        new Promise<Result>((resolve, reject) => {
          this.#interrupt = reject;
          this.#advance(parameter).then(resolve, reject);
        }),
    );
    this.#last = result.catch(() => undefined);
    return result;
  }

  /** Closes the generator. */
  async return(): Promise<Result> {
    await this.#end("close", makeError("OperationAborted", `${this.context.info.name}: the generator was closed`));
    return over;
  }

  /** Aborts the generator. */
  async throw(error: unknown): Promise<Result> {
    await this.#end("abort", error);
    throw error;
  }

  async [asyncDispose](): Promise<void> {
    await this.return();
  }

  async #advance(parameter: unknown): Promise<Result> {
    if (this.#isDone) return over;
    try {
      const { signal } = this.options;
      checkSignal(signal);
      signal?.throwIfAborted();
      this.#opened ??= this.#open();
      const index = await within(this.#opened, { signal }, "");
      if (this.#isDone) return over;
      const value = await this.#step("next", index, this.options, parameter);
      return { done: false, value: this.context.info.type === "void" ? undefined : value };
    } catch (error) {
      this.#giveUp(error);
      if (error instanceof RobotRaconteurError && error.code === ErrorCode.StopIteration) return over;
      throw error;
    }
  }

  /** Without the signal: who gives it up still has to learn the index, to abort it. */
  async #open(): Promise<number> {
    const { session, path, info } = this.context;
    const { timeout } = this.options;
    return Number(await session.request((core) => core.openGenerator(path, info.name, this.args), { timeout }));
  }

  #step(step: GeneratorStep, index: number, options?: CallOptions, parameter?: unknown): Promise<RrValue> {
    const { session, path, info } = this.context;
    this.#isSent = false;
    const sent = () => void (this.#isSent = true);
    const ask = () =>
      session.request((core) => core.stepGenerator(step, path, info.name, index, parameter, sent), options);
    return step === "next" ? ask() : session.urgently(ask);
  }

  /** Tells the service at once, and the step under way with `reason`. Resolves when the service has answered. */
  #end(step: GeneratorStep, reason: unknown): Promise<void> {
    if (!this.#ending) {
      this.#ending = this.#isDone ? Promise.resolve() : this.#leave(step);
      this.#ending.catch(() => undefined); // whoever waits for it hears of it
      this.#isDone = true;
      this.#interrupt?.(reason);
    }
    return this.#ending;
  }

  async #leave(step: GeneratorStep): Promise<void> {
    const index = await this.#opened?.catch(() => undefined); // one that the service refused is not there
    if (index !== undefined && !this.context.session.isClosed) await this.#step(step, index);
  }

  /** An error of the service ended the generator there too; after one of this side it still runs. */
  #giveUp(error: unknown): void {
    const isRemote = error instanceof RobotRaconteurError && error.code !== ErrorCode.RequestTimeout && this.#isSent;
    if (!isRemote) void this.#end("abort", error);
    this.#isDone = true;
  }
}

const over: Result = { done: true, value: undefined };
