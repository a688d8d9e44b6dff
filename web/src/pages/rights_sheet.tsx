// What one may do: with which devices, and with the gateway.
// Layer: web/pages.

import { language, t } from "../app/language";
import { askRights } from "../gateway/rights";
import type { Rights } from "../gateway/rights";
import type { Who } from "../gateway/session";
import { useAsked } from "../ui/use_asked";
import { sentence } from "../ui/words";

export interface RightsSheetProps {
  who: Who;
}

export default function RightsSheet({ who }: RightsSheetProps) {
  const { answer, failure } = useAsked(askRights, JSON.stringify(who));
  if (failure !== null) return <p role="alert">{sentence(failure)}</p>;
  if (!answer) return <p role="status">{t("Asking the gateway for them.")}</p>;
  const { devices, gateway } = answer;
  return (
    <>
      <p class="note">{proofText(answer)}</p>
      {devices.length === 0 && <p>{t("You may use no device.")}</p>}
      <dl>
        {devices.map(({ device, all, some }) => (
          <div key={device} data-rights={device}>
            <dt>{device}</dt>
            {all.length > 0 && <dd>{t("Everything: {0}", verbsText(all))}</dd>}
            {some.length > 0 && <dd>{t("Some of it: {0}", verbsText(some))}</dd>}
          </div>
        ))}
        {gateway.length > 0 && (
          <div data-rights-gateway>
            <dt>{t("The gateway")}</dt>
            <dd>{verbsText(gateway)}</dd>
          </div>
        )}
      </dl>
    </>
  );
}

/** As the configuration writes them: they are looked up there. */
function verbsText(verbs: readonly string[]): string {
  return verbs.join(", ");
}

function proofText({ proof, expiresAt }: Rights): string {
  const shown = t("Known by: {0}.", proof);
  if (expiresAt === null) return shown;
  return `${shown} ${t("Good until {0}.", new Date(expiresAt).toLocaleString(language))}`;
}
