// Reads answers field by field: an older or newer gateway may leave some out. Layer: web/gateway.

export function is_record(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null;
}

export function text(value: unknown): string {
  return typeof value === "string" ? value : "";
}
