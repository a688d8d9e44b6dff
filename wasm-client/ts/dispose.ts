// `await using`, also where the engine knows the word but not the symbol. Layer: wasm-client/ts.
/// <reference lib="esnext.disposable" preserve="true" />

/** That of the engine; else the one that compilers stand in for it. */
export const asyncDispose: typeof Symbol.asyncDispose =
  Symbol.asyncDispose ?? (Symbol.for("Symbol.asyncDispose") as typeof Symbol.asyncDispose);
