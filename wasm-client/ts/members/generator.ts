// Generator functions: results that come one after another. Layer: wasm-client/ts/members.
// Source: sessions spec section 2.10.
import { ErrorCode, RobotRaconteurError } from "../errors.js";
import type { CallOptions, MemberInfo, RrValue } from "../types.js";
import type { GeneratorStep } from "../wasm_module.js";
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

/** One run. The service hears of it with the first next(); steps follow one another, however they are asked for. */
class Generator implements AsyncGenerator<RrValue | undefined, undefined, unknown> {
  #index: number | undefined;
  #isDone = false;
  /** Whether the core took the last step. */
  #isSent = false;
  /** The step before. */
  #last: Promise<unknown> = Promise.resolve();

  constructor(
    private readonly context: MemberContext,
    private readonly args: readonly unknown[],
    private readonly options: CallOptions,
  ) {}

  [Symbol.asyncIterator](): this {
    return this;
  }

  next(parameter?: unknown): Promise<Result> {
    return this.#afterLast(async () => {
      if (this.#isDone) return { done: true, value: undefined };
      try {
        this.#index ??= await this.#open();
        const value = await this.#step("next", parameter);
        return { done: false, value: this.context.info.type === "void" ? undefined : value };
      } catch (error) {
        this.#giveUp(error);
        if (error instanceof RobotRaconteurError && error.code === ErrorCode.StopIteration) {
          return { done: true, value: undefined };
        }
        throw error;
      }
    });
  }

  /** Closes the generator. */
  return(): Promise<Result> {
    return this.#afterLast(async () => {
      await this.#end("close");
      return { done: true, value: undefined };
    });
  }

  /** Aborts the generator. */
  throw(error: unknown): Promise<Result> {
    return this.#afterLast(async () => {
      await this.#end("abort");
      throw error;
    });
  }

  async [Symbol.asyncDispose](): Promise<void> {
    await this.return();
  }

  async #open(): Promise<number> {
    const { session, path, info } = this.context;
    return Number(await session.request((core) => core.openGenerator(path, info.name, this.args), this.options));
  }

  #step(step: GeneratorStep, parameter?: unknown): Promise<RrValue> {
    const { session, path, info } = this.context;
    const index = this.#index as number;
    const options = step === "next" ? this.options : {};
    this.#isSent = false;
    return session.request((core) => {
      const id = core.stepGenerator(step, path, info.name, index, parameter);
      this.#isSent = true;
      return id;
    }, options);
  }

  async #end(step: GeneratorStep): Promise<void> {
    const isRunning = this.#index !== undefined && !this.#isDone && !this.context.session.isClosed;
    this.#isDone = true;
    if (isRunning) await this.#step(step);
  }

  /** An error of the service ended the generator there too; after one of this side it still runs. */
  #giveUp(error: unknown): void {
    const isRemote = error instanceof RobotRaconteurError && error.code !== ErrorCode.RequestTimeout && this.#isSent;
    // Nobody waits for it: the first error is the one to tell.
    if (!isRemote) void this.#end("abort").catch(() => undefined);
    this.#isDone = true;
  }

  #afterLast(step: () => Promise<Result>): Promise<Result> {
    const result = this.#last.then(step);
    this.#last = result.catch(() => undefined);
    return result;
  }
}
