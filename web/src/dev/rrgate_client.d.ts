declare module "rrgate-client" {
  export class RobotRaconteurError extends Error {
    code: number;
    subName: string;
    param: unknown;
  }
  export type MemberKind = "property" | "function" | "event" | "objref" | "pipe" | "callback" | "wire" | "memory";
  export interface MemberInfo {
    readonly name: string;
    readonly kind: MemberKind;
    readonly type: string;
    readonly parameters: readonly { readonly name: string; readonly type: string }[];
    readonly modifiers: readonly string[];
    readonly documentation: string;
  }
  export interface CallOptions { signal?: AbortSignal | undefined; timeout?: number | undefined }
  export interface DynamicMember {
    (...args: unknown[]): Promise<unknown>;
    get(options?: CallOptions): Promise<unknown>;
    get(index?: number | string, options?: CallOptions): Promise<RemoteObject>;
    set(value: unknown, options?: CallOptions): Promise<void>;
    on(listener: (...args: unknown[]) => void): () => void;
    connect(options?: CallOptions): AsyncIterable<unknown>;
    poke(value: unknown, options?: CallOptions): Promise<void>;
  }
  export interface ObjectInfo {
    readonly type: string;
    readonly members: readonly MemberInfo[];
    member(name: string): DynamicMember;
    close(): Promise<void>;
    onClose(closed: (reason?: RobotRaconteurError) => void): () => void;
  }
  export type RemoteObject = { readonly $: ObjectInfo } & { readonly [member: string]: DynamicMember };
  export function connect(url: string, options?: CallOptions): Promise<RemoteObject>;
}
