// Which objects the demo robot's page is for.
// Layer: web/robot. Source: experimental.create and create2, simulatedcreate.

import type { Remote } from "./remote";

/** By the members that the page cannot do without. */
export function isCreate(remote: Remote): boolean {
  const drive = remote.members.find((m) => m.name === "Drive" && m.kind === "function");
  return (
    drive?.parameters.length === 2 &&
    drive.parameters.every((p) => p.type === "int16") &&
    remote.has("DistanceTraveled", "property")
  );
}

/** By the name of its type, while no object is known. */
export function isNamedCreate(type: string): boolean {
  return /^experimental\.(create\d*\.Create|simulatedcreate\.SimulatedCreate)$/.test(type);
}
