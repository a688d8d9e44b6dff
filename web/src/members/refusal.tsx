// Why a command failed; where that is the want of the right to command, this is where it is taken.
// Layer: web/members.

import { useRef } from "preact/hooks";
import type { Place } from "../app/router";
import type { Remote } from "../robot/remote";
import { ControlLine, useControl } from "../ui/control_line";
import { Failure } from "../ui/failure";

export interface RefusalProps {
  failure: string | null;
  isLocked: boolean;
  object: Remote | null;
  place: Place;
}

export function Refusal({ failure, isLocked, object, place }: RefusalProps) {
  const wasLocked = useRef(false);
  wasLocked.current ||= isLocked; // what is held is given back by hand, or with the page
  return (
    <>
      <Failure text={failure} />
      {wasLocked.current && <ControlByHand object={object} place={place} />}
    </>
  );
}

function ControlByHand({ object, place }: Pick<RefusalProps, "object" | "place">) {
  const { last } = useControl(object);
  return <ControlLine control={last} isThere={object !== null} place={place} byHand />;
}
