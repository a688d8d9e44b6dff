// Panels of a board by themselves. Test support.
import { show } from "./shown";
import type { ComponentType } from "preact";
import type { PanelProps } from "../../web/src/panels/panel";
import type { Member, Remote } from "../../web/src/robot/remote";
import { Definitions } from "../../web/src/values/definitions";

/** A panel of the service "s" of the device "d", without settings. */
export const showPanel = (panel: ComponentType<PanelProps>, object: Remote, members: readonly Member[]) =>
  show(panel, {
    object,
    members,
    definitions: new Definitions([]),
    scope: "",
    place: { device: "d", service: "s", object: "" },
    settings: {},
    change: () => undefined,
  } as unknown as PanelProps);
