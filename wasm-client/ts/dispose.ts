// `await using`, also where the engine knows the word but not the symbol. Layer: wasm-client/ts.
/// <reference lib="esnext.disposable" preserve="true" />

/** That of the engine; else the one that compilers stand in for it. */
export const asyncDispose: typeof Symbol.asyncDispose =
  // eslint-disable-next-line @typescript-eslint/no-unnecessary-condition -- older engines
  Symbol.asyncDispose ?? (Symbol.for("Symbol.asyncDispose") as typeof Symbol.asyncDispose);
