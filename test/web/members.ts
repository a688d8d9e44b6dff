// Members as a service's definition gives them. Test support.
import type { Member } from "../../web/src/robot/remote";

export const memberOf = (kind: Member["kind"], type: string, name: string): Member => ({
  name,
  kind,
  type,
  parameters: [],
  modifiers: [],
  documentation: "",
});
