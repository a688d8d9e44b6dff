/** Of notices.mjs, for vite.config.ts of the dashboard. */
export function licences(further?: () => string[]): {
  name: string;
  generateBundle(
    this: { emitFile(file: { type: "asset"; fileName: string; source: string }): string },
    options: unknown,
    bundle: Record<string, { moduleIds?: string[] }>,
  ): void;
};
export function wasmNotices(): string[];
