// Requests of access, for those who decide on them.
// Layer: web/pages.

import { useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import type { AccessDesk, AccessRequest } from "../gateway/access";
import { useMeant, useSettled } from "../ui/use_settled";
import { sentence } from "../ui/words";

export function AccessPart({ access }: { access: AccessDesk }) {
  const pending = useStore(access.pending);
  const trouble = useStore(access.trouble);
  const isSettled = useSettled(pending.map(({ id }) => id).join());
  if (pending.length === 0 && trouble === null) return null;
  return (
    <section class="access-part" aria-label={t("Requests of access")}>
      <h2 class="place-name">{t("Access")}</h2>
      <ul class="devices">
        {pending.map((request) => (
          <RequestRow key={request.id} request={request} access={access} isSettled={isSettled} />
        ))}
      </ul>
      {trouble !== null && (
        <p class="failure" role="alert">
          {sentence(trouble)}
        </p>
      )}
    </section>
  );
}

interface RequestRowProps {
  request: AccessRequest;
  access: AccessDesk;
  isSettled: () => boolean;
}

function RequestRow({ request, access, isSettled }: RequestRowProps) {
  const meant = useMeant(isSettled);
  const [roles, setRoles] = useState("viewer");
  const words = roles.split(/[\s,]+/).filter((role) => role !== "");
  return (
    <li class="device" data-request={request.name}>
      <p>
        <strong>{request.name}</strong> <span class="code">({request.client})</span> {t("asks for access")}
        {request.reason !== "" && <>: {request.reason}</>}
      </p>
      <form class="access-form" onSubmit={(event) => event.preventDefault()}>
        <label>
          {t("Roles")}{" "}
          <input class="field" type="text" value={roles} onInput={(event) => setRoles(event.currentTarget.value)} />
        </label>
        <button
          class="button"
          type="submit" // Enter in the field presses it
          disabled={words.length === 0}
          {...meant(() => void access.approve(request, words))}
        >
          {t("Approve")}
        </button>
        <button class="button" type="button" {...meant(() => void access.deny(request))}>
          {t("Deny")}
        </button>
      </form>
    </li>
  );
}
