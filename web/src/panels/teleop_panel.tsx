// Drives a function, wire or property by keys, sticks on the screen and a gamepad; letting go sends the neutral value at once.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { stopNow } from "../robot/control";
import { Driver } from "../robot/driver";
import { onLetGo } from "../robot/let_go";
import { explain } from "../robot/remote";
import { passOn } from "../robot/stop";
import { ControlLine, useControl } from "../ui/control_line";
import { Failure } from "../ui/failure";
import { jsonOf } from "../values/draft";
import { DraftInput } from "./draft_input";
import { HeldSticks } from "./held_sticks";
import type { Side } from "./held_sticks";
import { NumberField } from "./number_field";
import { inputsOf, membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { MemberSelect } from "./parts";
import { StickPad } from "./stick";
import type { StickMoves } from "./stick";
import {
  AT_REST,
  commandOf,
  Commands,
  findGamepad,
  isStickKey,
  neutralTexts,
  partFor,
  readAxes,
  readNeutral,
  STICKS,
  tell,
} from "./teleop";
import type { Axis, Deflection } from "./teleop";
import "../robot_view/pad.css";
import "./teleop_panel.css";

const REPEAT_MS = 100;

export default function TeleopPanel(props: PanelProps) {
  const { object, stopWithout, members, definitions, scope, place, settings, change } = props;
  const choices = membersFor("teleop", members);
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  const inputs = useMemo(() => (member ? inputsOf(member) : []), [member]);
  const mapping = useMemo(
    () => ({ axes: readAxes(settings), neutral: readNeutral(settings, inputs, definitions, scope) }),
    [settings, inputs, definitions, scope],
  );
  const [isNew] = useState(mapping.axes.length === 0);
  const [failure, setFailure] = useState<string | null>(null);
  const { control, last, isOpen } = useControl(object);

  const driver = useMemo(
    () =>
      new Driver<Deflection>({
        rest: AT_REST,
        same: (a, b) => STICKS.every((stick) => a[stick] === b[stick]),
        onError: (error) => setFailure(explain(error)),
        repeatMs: REPEAT_MS,
      }),
    [],
  );
  const commands = useMemo(() => new Commands(), [name]); // also over a connection that is made anew
  const latest = useRef({ member, mapping, definitions, scope, stopWithout });
  latest.current = { member, mapping, definitions, scope, stopWithout };
  useEffect(() => {
    if (!object || !control || !member) return;
    let by = latest.current;
    const send = async (deflection: Deflection, insists: boolean): Promise<void> => {
      if (latest.current.member === member) by = latest.current; // else it is the old one that is told to rest
      const given = commands.of(by.mapping, inputsOf(member), deflection, by.definitions, by.scope);
      const isRest = deflection === AT_REST;
      const way = (): Promise<unknown> => tell(object, member, given, isRest);
      if (!isRest) {
        await way();
        return setFailure(null);
      }
      const stop = stopNow(object, insists, way);
      setFailure((await (insists ? passOn(stop, latest.current.stopWithout) : stop)) ?? null);
    };
    driver.setConnection({ send, right: control });
    return () => driver.dispose();
  }, [object, control, member, commands, driver]);

  const enabled = object !== null && isOpen && mapping.axes.length > 0;
  const { shown, pad, sticks, stop, hasGamepad, ignored } = useSticks(
    driver,
    enabled,
    mapping.axes,
    () => control?.mayCommand === true,
  );
  const setAxes = (axes: readonly Axis[]): void => change({ ...settings, axes });
  return (
    <div class="teleop panel-scroll">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ member: next, axes: [] })} />
      </div>
      <ControlLine control={last} isThere={object !== null} place={place} />
      <div
        class={`teleop-pad ${enabled ? "" : "is-off"}`}
        role="application"
        aria-label={t("Sticks: W, A, S, D and the arrow keys")}
        aria-disabled={!enabled}
        tabIndex={0}
        {...pad}
      >
        <StickPad label={t("Left stick")} x={shown["left-x"]} y={shown["left-y"]} {...sticks.left} />
        <button class="pad-stop" type="button" disabled={!object || !member} onPointerDown={stop} onClick={stop}>
          {t("Rest")}
        </button>
        <StickPad label={t("Right stick")} x={shown["right-x"]} y={shown["right-y"]} {...sticks.right} />
      </div>
      <p class="note" data-gamepad={hasGamepad}>
        {hasGamepad
          ? t("A gamepad drives while you are in control.")
          : ignored !== ""
            ? t("{0} is ignored: the browser does not know which of its axes are the sticks of a gamepad.", ignored)
            : t("Click here for the keys. Press a button of a gamepad to use it.")}
      </p>
      <Sent {...{ mapping, inputs, definitions, scope, shown }} />
      <Failure text={failure} />
      <details open={isNew}>
        <summary>{t("Axes")}</summary>
        <AxesForm axes={mapping.axes} inputs={inputs} change={setAxes} />
        {inputs.map(({ name: label, type }, i) => {
          const draft = mapping.neutral[i];
          if (draft?.kind !== "text") return null;
          return (
            <DraftInput
              key={label}
              label={t("{0} at rest", label)}
              type={type}
              definitions={definitions}
              scope={scope}
              draft={draft}
              change={(next) => {
                const neutral = mapping.neutral.map((each, at) => (at === i ? next : each));
                change({ ...settings, neutral: neutralTexts(neutral, inputs) });
              }}
            />
          );
        })}
      </details>
    </div>
  );
}

type Shown = Pick<PanelProps, "definitions" | "scope"> & {
  mapping: Parameters<typeof commandOf>[0];
  inputs: Parameters<typeof commandOf>[1];
  shown: Deflection;
};

/** What the sticks are worth just now, or what is wrong with the axes. */
function Sent({ mapping, inputs, definitions, scope, shown }: Shown) {
  let text: string;
  try {
    text = JSON.stringify(jsonOf(commandOf(mapping, inputs, shown, definitions, scope))).slice(1, -1);
  } catch (error) {
    return <Failure text={(error as Error).message} />;
  }
  return (
    <p class="note">
      <code data-teleop="command">{text}</code>
    </p>
  );
}

/** All that moves the sticks; in doubt they are at rest. */
function useSticks(driver: Driver<Deflection>, enabled: boolean, axes: readonly Axis[], mayPoll: () => boolean) {
  const [shown, setShown] = useState<Deflection>(AT_REST);
  const [hasGamepad, setHasGamepad] = useState(false);
  const [ignored, setIgnored] = useState("");
  const latest = useRef({ enabled, axes, mayPoll });
  latest.current = { enabled, axes, mayPoll };
  const actions = useMemo(() => {
    const held = new HeldSticks();
    const apply = (): void => {
      const now = latest.current.enabled ? partFor(latest.current.axes, held.deflection) : AT_REST;
      driver.want(now);
      setShown(now);
    };
    const letGo = (): void => {
      held.letGo();
      apply();
    };
    const stick = (side: Side): StickMoves => ({
      press: () => held.press(side),
      move: (x, y) => void (held.push(side, x, y) && apply()),
      release: () => {
        held.release(side);
        apply();
      },
    });
    const keyDown = (event: KeyboardEvent): void => {
      if (event.ctrlKey || event.metaKey || event.altKey) return letGo(); // a shortcut; its key-up may never come
      if (!isStickKey(event.code)) return;
      event.preventDefault(); // arrows would scroll
      if (event.repeat) return;
      held.pressKey(event.code);
      apply();
    };
    const keyUp = (event: KeyboardEvent): void => {
      if (event.key === "Meta") return letGo(); // macOS tells no key-up of keys that were held with it
      if (held.releaseKey(event.code)) apply();
    };
    const poll = (): void => {
      const { axes: pushed, ignored: other } = findGamepad(navigator.getGamepads?.() ?? []);
      setHasGamepad(pushed !== null);
      setIgnored(other);
      if (held.poll(pushed, latest.current.mayPoll() && document.hasFocus())) apply();
    };
    return {
      letGo,
      poll,
      stop: () => {
        letGo();
        driver.stop();
      },
      pad: { onKeyDown: keyDown, onKeyUp: keyUp, onFocusOut: letGo },
      left: stick("left"),
      right: stick("right"),
    };
  }, [driver]);
  useEffect(() => {
    if (!enabled) actions.letGo();
  }, [enabled, actions]);
  useEffect(() => {
    let frame = requestAnimationFrame(function look() {
      actions.poll();
      frame = requestAnimationFrame(look);
    });
    const forget = onLetGo(actions.letGo);
    return () => {
      cancelAnimationFrame(frame);
      forget();
      actions.letGo();
    };
  }, [actions]);
  return {
    shown,
    hasGamepad,
    ignored,
    pad: actions.pad,
    stop: actions.stop,
    sticks: { left: actions.left, right: actions.right },
  };
}

interface AxesFormProps {
  axes: readonly Axis[];
  inputs: readonly { name: string; type: string }[];
  change: (axes: readonly Axis[]) => void;
}

function AxesForm({ axes, inputs, change }: AxesFormProps) {
  const set = (index: number, part: Partial<Axis>): void =>
    change(axes.map((axis, i) => (i === index ? { ...axis, ...part } : axis)));
  const names: Readonly<Record<Axis["stick"], string>> = {
    "left-x": t("left stick, right"),
    "left-y": t("left stick, up"),
    "right-x": t("right stick, right"),
    "right-y": t("right stick, up"),
  };
  return (
    <ol class="axes">
      {axes.map((axis, i) => (
        <li key={i} class="row-line">
          <select
            class="field"
            aria-label={t("Stick of axis {0}", i + 1)}
            value={axis.stick}
            onChange={(event) =>
              set(i, { stick: STICKS.find((each) => each === event.currentTarget.value) ?? "left-y" })
            }
          >
            {STICKS.map((each) => (
              <option key={each} value={each}>
                {names[each]}
              </option>
            ))}
          </select>
          <input
            class="field"
            aria-label={t("Number of axis {0}", i + 1)}
            placeholder="velocity[0]"
            value={axis.path}
            onInput={(event) => set(i, { path: event.currentTarget.value.trim() })}
          />
          <NumberField label={t("Scale of axis {0}", i + 1)} value={axis.scale} change={(scale) => set(i, { scale })} />
          <NumberField
            label={t("Dead zone of axis {0}", i + 1)}
            value={axis.deadZone}
            least={0}
            most={0.9}
            change={(deadZone) => set(i, { deadZone })}
          />
          <button class="button button-quiet" type="button" onClick={() => change(axes.filter((_, at) => at !== i))}>
            {t("Remove")}
            <span class="unseen"> {t("axis {0}", i + 1)}</span>
          </button>
        </li>
      ))}
      <li>
        <button
          class="button"
          type="button"
          onClick={() =>
            change([
              ...axes,
              {
                stick: STICKS[[1, 0, 2, 3][axes.length % 4] ?? 1] ?? "left-y",
                path: inputs[0]?.name ?? "",
                scale: 1,
                deadZone: 0.1,
              },
            ])
          }
        >
          {t("Add axis")}
        </button>
      </li>
    </ol>
  );
}
