declare module "rrgate-client" {
  export class RobotRaconteurError extends Error {
    code: number;
    subName: string;
    param: unknown;
  }
  export function connect(url: string, options?: { signal?: AbortSignal; timeout?: number }): Promise<unknown>;
}
