// A part of the page whose code is loaded once it is looked at.
// Layer: web/ui.

import type { ComponentType } from "preact";
import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { Failure } from "./failure";

export function loaded<Props>(load: () => Promise<{ default: ComponentType<Props> }>): ComponentType<Props> {
  return (props) => {
    const [Shown, setShown] = useState<ComponentType<Props> | null>(null);
    const [hasFailed, setFailed] = useState(false);
    useEffect(() => {
      load().then(
        ({ default: shown }) => setShown(() => shown),
        () => setFailed(true),
      );
    }, []);
    if (hasFailed) return <Failure text={t("The gateway did not send this part of the page. Load the page again.")} />;
    return Shown && <Shown {...props} />;
  };
}
