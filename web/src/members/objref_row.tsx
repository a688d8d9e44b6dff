// A reference to another object: a link to its page, with a field for the index where it needs one.
// Layer: web/members.

import { useState } from "preact/hooks";
import { t } from "../app/language";
import { formatRoute } from "../app/router";
import { RowHead } from "./row";
import type { MemberRowProps } from "./row";
import { ValueInput } from "./value_input";
import { Failure } from "../ui/failure";
import { parseInput } from "../values/parse";

export function ObjrefRow({ member, route, live }: MemberRowProps) {
  const [index, setIndex] = useState("");
  const [failure, setFailure] = useState<string | null>(null);
  const indexType = member.type.endsWith("{string}")
    ? "string"
    : /(\{int32\}|\[\])$/.test(member.type)
      ? "int32"
      : null;
  const address = (at: string | null): string =>
    formatRoute(route.device, route.service, [...route.path, { member: member.name, index: at }]);
  const open = (event: Event): void => {
    event.preventDefault();
    try {
      const at = String(parseInput(index, indexType ?? "string"));
      if (at === "") throw new Error("nothing given; expected a key");
      location.hash = address(at);
    } catch (error) {
      setFailure((error as Error).message);
    }
  };
  return (
    <>
      <RowHead member={member} />
      {indexType === null ? (
        <a class="button" href={address(null)}>
          {t("Open")}
          <span class="unseen"> {member.name}</span>
        </a>
      ) : (
        <form class="row-line" onSubmit={open}>
          <ValueInput
            quiet
            label={t("Index of {0}", member.name)}
            type={indexType}
            text={index}
            disabled={!live}
            onText={(text) => (setIndex(text), setFailure(null))}
          />
          <button class="button" type="submit" disabled={!live}>
            {t("Open")}
            <span class="unseen"> {member.name}</span>
          </button>
        </form>
      )}
      <Failure text={failure} />
    </>
  );
}
