// A device for the tests of what there is for frameworks, and waiting for what comes of it.
import { TestService } from "./service.js";

const definition = `service test.framework
stdver 0.10
object Robot
  property double speed
  wire double level [readonly]
  event bump(int32 side)
  function double add(double left)
  function void fail(string name, string text)
  function void fire_bump(int32 side)
  function void publish_level(double value)
end`;

export const url = "ws://test.example/?service=test";

/** `options`: for subscriptions. */
export async function startDevice() {
  const service = await TestService.start({ definitions: [definition], root: "test.framework.Robot" });
  return { service, options: { transport: service.transport } };
}

/** Until `look` gives true; does `action` before each look. */
export async function until(look: () => boolean, action?: () => unknown): Promise<void> {
  for (let i = 0; i < 400 && !look(); ++i) {
    await action?.();
    await new Promise((resolve) => setTimeout(resolve, 5));
  }
  if (!look()) throw new Error(`never: ${String(look)}`);
}
