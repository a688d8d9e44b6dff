// The model of a robot in a 3-D panel: URDF of a property, or of a file, which is kept with the board.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Settings } from "../board/board";
import { untilDone } from "../live/pause";
import { explain } from "../robot/remote";
import type { Member, Remote } from "../robot/remote";
import { Failure } from "../ui/failure";
import { FileInput } from "../ui/file_input";
import { compose, ORIGIN } from "../values/frames";
import type { Frame, Pose } from "../values/frames";
import { posesOfLinks, readUrdf } from "../values/urdf";
import type { Body, Model } from "../values/urdf";
import type { Joint } from "./joints";
import { textIn } from "./panel";
import type { PanelProps } from "./panel";

const MOST_BYTES = 100_000; // it is in the address of the board, too
/** Of `settings.model`; names of properties are none of them. */
const FROM_FILE = "/file";
const NONE = "/none";

/** A text that is no URDF is a failure; reading a property is tried again until it succeeds. */
export function useModel(
  object: Remote | null,
  members: readonly Member[],
  settings: Settings,
): { model: Model | null; failure: string | null } {
  const chosen = chosenIn(settings, members);
  const property = chosen === FROM_FILE || chosen === NONE ? "" : chosen;
  const [read, setRead] = useState<{ property: string; text: string; failure: string | null } | null>(null);
  useEffect(() => {
    if (!object || property === "") return;
    const stop = new AbortController();
    const work = async (): Promise<void> => {
      const text = await object.get(property);
      if (!stop.signal.aborted) setRead({ property, text: String(text), failure: null });
    };
    const failed = (error: unknown): void => setRead({ property, text: "", failure: explain(error) });
    void untilDone(work, failed, stop.signal);
    return () => stop.abort();
  }, [object, property]);

  const ofProperty = property !== "" && read?.property === property ? read : null;
  const text = chosen === FROM_FILE ? textIn(settings, "urdf") : (ofProperty?.text ?? "");
  const source = chosen === FROM_FILE ? textIn(settings, "file") : property;
  const parsed = useMemo(() => {
    if (text === "") return { model: null, failure: null };
    try {
      return { model: readUrdf(text), failure: null };
    } catch (error) {
      return { model: null, failure: t("No URDF can be shown of {0}: {1}", source, explain(error)) };
    }
  }, [text, source]);
  return ofProperty?.failure ? { model: null, failure: ofProperty.failure } : parsed;
}

/** Which model there is, while the board is arranged. */
export function ModelTools({ members, settings, change }: Pick<PanelProps, "members" | "settings" | "change">) {
  const input = useRef<HTMLInputElement>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const file = textIn(settings, "file");
  const open = (chosen: File | undefined): void => {
    if (!chosen) return;
    const { name, size } = chosen;
    if (size > MOST_BYTES) return setFailure(t("{0} has {1} bytes, expected at most {2}", name, size, MOST_BYTES));
    void chosen
      .text()
      .then((urdf) => {
        readUrdf(urdf);
        setFailure(null);
        change({ ...settings, model: FROM_FILE, file: name, urdf });
      })
      .catch((error: unknown) => setFailure(t("No URDF can be shown of {0}: {1}", name, explain(error))));
  };
  return (
    <div class="panel-select model-tools">
      <label>
        <span class="unseen">{t("Model")}</span>
        <select
          class="field"
          value={chosenIn(settings, members)}
          onChange={(event) => change({ ...settings, model: event.currentTarget.value })}
        >
          <option value={NONE}>{t("No model")}</option>
          {textsOf(members).map(({ name, kind }) => (
            <option key={name} value={name}>
              {name} ({t(kind)})
            </option>
          ))}
          {file !== "" && <option value={FROM_FILE}>{file}</option>}
        </select>
      </label>
      <button class="button button-quiet" type="button" onClick={() => input.current?.click()}>
        {t("Open URDF")}
      </button>
      <FileInput input={input} accept=".urdf,.xml" label={t("URDF file")} open={open} />
      <Failure text={failure} />
    </div>
  );
}

/** What of the model is not shown, or does not move. */
export function ModelNotes({ model, joints }: { model: Model | null; joints: readonly Joint[] }) {
  if (!model) return null;
  const isMoved = model.links.some(({ joint }) => joints.some(({ name }) => name === joint?.name));
  return (
    <>
      {model.meshes > 0 && <p class="note">{t("Meshes of the model, which are not shown: {0}", model.meshes)}</p>}
      {joints.length > 0 && !isMoved && (
        <p class="note">
          {t("The model has none of the robot's joints: {0}", joints.map(({ name }) => name).join(", "))}
        </p>
      )}
    </>
  );
}

/** By joint, in radians and metres. */
export function anglesOf(joints: readonly Joint[], positions: ArrayLike<number> | undefined): Map<string, number> {
  const angle = ({ unit }: Joint, i: number): number => (positions?.[i] ?? 0) * (unit === "°" ? Math.PI / 180 : 1);
  return new Map(joints.map((joint, i) => [joint.name, angle(joint, i)]));
}

/** `bones`: from each link without shapes to those that it carries. */
export function placed(
  model: Model | null,
  angles: ReadonlyMap<string, number>,
): { bodies: Body[]; bones: Pose[][]; links: Frame[] } {
  if (!model) return { bodies: [], bones: [], links: [] };
  const poses = posesOfLinks(model, angles);
  const links = model.links.map((link, i) => ({ ...link, pose: poses[i] ?? ORIGIN }));
  return {
    bodies: links.flatMap(({ bodies, pose }) =>
      bodies.map((body) => ({ shape: body.shape, pose: compose(pose, body.pose) })),
    ),
    bones: links.flatMap(({ parent, pose }) => {
      const from = links[parent];
      return from && from.bodies.length === 0 ? [[from.pose, pose]] : [];
    }),
    links: links.map(({ name, pose }) => ({ name, pose })),
  };
}

/** What is chosen, else the property whose name says that it is a model. */
function chosenIn(settings: Settings, members: readonly Member[]): string {
  const chosen = textIn(settings, "model");
  if (chosen === FROM_FILE || chosen === NONE) return chosen;
  const texts = textsOf(members);
  const found = chosen === "" ? texts.find(({ name }) => /urdf|robot_description/i.test(name)) : { name: chosen };
  return found?.name ?? NONE;
}

function textsOf(members: readonly Member[]): Member[] {
  return members.filter(
    ({ kind, type, modifiers }) => kind === "property" && type === "string" && !modifiers.includes("writeonly"),
  );
}
