// Generator functions: results that come one after another. Layer: wasm-client/ts/members.
// Source: sessions spec section 2.10.
import { ErrorCode, RobotRaconteurError } from "../errors.js";
import type { CallOptions, MemberInfo, RrValue } from "../types.js";
import type { GeneratorStep } from "../wasm_module.js";
import { signature, split_arguments } from "./member.js";
import type { MemberContext } from "./member.js";

const suffix = "{generator}";

export function is_generator({ type, parameters }: MemberInfo): boolean {
  return type.endsWith(suffix) || takes_values({ parameters });
}

function takes_values({ parameters }: Pick<MemberInfo, "parameters">): boolean {
  return parameters.at(-1)?.type.endsWith(suffix) ?? false;
}

type Result = IteratorResult<RrValue | undefined, undefined>;

export function make_generator_function(context: MemberContext): (...args: unknown[]) => Generator {
  const count = context.info.parameters.length - (takes_values(context.info) ? 1 : 0);
  const call = (...args: unknown[]) => {
    const { values, options } = split_arguments(signature(context.info), count, args);
    return new Generator(context, values, options);
  };
  return Object.defineProperty(call, "name", { value: context.info.name });
}

/** One run. The service hears of it with the first next(); steps follow one another, however they are asked for. */
class Generator implements AsyncGenerator<RrValue | undefined, undefined, unknown> {
  #index: number | undefined;
  #is_done = false;
  /** Whether the core took the last step. */
  #is_sent = false;
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
    return this.#after_last(async () => {
      if (this.#is_done) return { done: true, value: undefined };
      try {
        this.#index ??= await this.#open();
        const value = await this.#step("next", parameter);
        return { done: false, value: this.context.info.type === "void" ? undefined : value };
      } catch (error) {
        this.#give_up(error);
        if (error instanceof RobotRaconteurError && error.code === ErrorCode.StopIteration) {
          return { done: true, value: undefined };
        }
        throw error;
      }
    });
  }

  /** Closes the generator. */
  return(): Promise<Result> {
    return this.#after_last(async () => {
      await this.#end("close");
      return { done: true, value: undefined };
    });
  }

  /** Aborts the generator. */
  throw(error: unknown): Promise<Result> {
    return this.#after_last(async () => {
      await this.#end("abort");
      throw error;
    });
  }

  async [Symbol.asyncDispose](): Promise<void> {
    await this.return();
  }

  async #open(): Promise<number> {
    const { session, path, info } = this.context;
    return Number(await session.request((core) => core.open_generator(path, info.name, this.args), this.options));
  }

  #step(step: GeneratorStep, parameter?: unknown): Promise<RrValue> {
    const { session, path, info } = this.context;
    const index = this.#index as number;
    const options = step === "next" ? this.options : {};
    this.#is_sent = false;
    return session.request((core) => {
      const id = core.step_generator(step, path, info.name, index, parameter);
      this.#is_sent = true;
      return id;
    }, options);
  }

  async #end(step: GeneratorStep): Promise<void> {
    const is_running = this.#index !== undefined && !this.#is_done && !this.context.session.is_closed;
    this.#is_done = true;
    if (is_running) await this.#step(step);
  }

  /** An error of the service ended the generator there too; after one of this side it still runs. */
  #give_up(error: unknown): void {
    const is_remote = error instanceof RobotRaconteurError && error.code !== ErrorCode.RequestTimeout && this.#is_sent;
    // Nobody waits for it: the first error is the one to tell.
    if (!is_remote) void this.#end("abort").catch(() => undefined);
    this.#is_done = true;
  }

  #after_last(step: () => Promise<Result>): Promise<Result> {
    const result = this.#last.then(step);
    this.#last = result.catch(() => undefined);
    return result;
  }
}
