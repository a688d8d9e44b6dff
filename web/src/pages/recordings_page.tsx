// The recordings that the gateway makes: beginning, stopping, getting, playing and deleting them.
// Layer: web/pages.

import { useEffect, useState } from "preact/hooks";
import { language, t } from "../app/language";
import { formatRoute } from "../app/router";
import { useStore } from "../app/store";
import { devicesOf, isReplay } from "../gateway/devices";
import type { DeviceList } from "../gateway/devices";
import { fileAddress, isUnderWay, MOST_REPLAYS, RecordingDesk } from "../gateway/recordings";
import type { Recording } from "../gateway/recordings";
import { session } from "../gateway/session";
import { isUsb } from "../gateway/usb_devices";
import { Failure } from "../ui/failure";
import { bytesText, sentence, span } from "../ui/words";
import "../styles/devices.css";

export interface RecordingsProps {
  list: DeviceList;
}

const ownDesk = new RecordingDesk(session);

export default function Recordings({ list }: RecordingsProps) {
  return <RecordingsPage desk={ownDesk} list={list} />;
}

export function RecordingsPage({ desk, list }: { desk: RecordingDesk; list: DeviceList }) {
  const state = useStore(desk.state);
  const trouble = useStore(desk.trouble);
  const playing = state?.list.filter(({ replay }) => replay !== "").length ?? 0;
  const mayPlay = playing < MOST_REPLAYS;
  useEffect(() => {
    desk.start();
    return () => desk.stop();
  }, [desk]);
  return (
    <div class="page page-narrow">
      <div class="service-head">
        <h1>{t("Recordings")}</h1>
      </div>
      {state && !state.enabled && (
        <section class="empty">
          <p>{t("This gateway records nothing: its configuration has no recordings.")}</p>
          <p>{t("Name a folder for them there, and what devices say can be recorded and played again:")}</p>
          <pre class="code">{EXAMPLE}</pre>
        </section>
      )}
      {state?.enabled && (
        <>
          <BeginForm desk={desk} list={list} />
          <p class="note recordings-taken">
            {t("{0} of {1} taken", bytesText(state.bytes), bytesText(state.maxBytes))}
          </p>
          {state.list.length === 0 && <p class="empty">{t("There are no recordings yet.")}</p>}
          <ul class="devices">
            {state.list.map((each) => (
              <RecordingRow key={each.name} recording={each} desk={desk} mayPlay={mayPlay} />
            ))}
          </ul>
        </>
      )}
      <Failure text={trouble} />
    </div>
  );
}

const EXAMPLE = `"recordings": { "folder": "/var/lib/rrgate/recordings" }`;

function BeginForm({ desk, list }: { desk: RecordingDesk; list: DeviceList }) {
  const devices = devicesOf(useStore(list.state)) ?? [];
  const choices = devices
    .filter(({ name }) => !isUsb(name) && !isReplay(name))
    .flatMap(({ name, services }) => services.map((service) => ({ device: name, service: service.name })));
  const [chosen, setChosen] = useState("");
  const choice = choices.find((each) => keyOf(each) === chosen) ?? choices[0];
  return (
    <form
      class="row-line"
      aria-label={t("New recording")}
      onSubmit={(event) => {
        event.preventDefault();
        if (choice) void desk.begin(choice.device, choice.service);
      }}
    >
      <label>
        <span class="unseen">{t("Service to record")}</span>
        <select
          class="field"
          value={choice ? keyOf(choice) : ""}
          onChange={(event) => setChosen(event.currentTarget.value)}
        >
          {choices.map((each) => (
            <option key={keyOf(each)} value={keyOf(each)}>
              {each.device} · {each.service}
            </option>
          ))}
        </select>
      </label>
      <button class="button" type="submit" disabled={!choice}>
        {t("Record")}
      </button>
    </form>
  );
}

function keyOf({ device, service }: { device: string; service: string }): string {
  return `${device}/${service}`;
}

const STATES: Readonly<Record<string, string>> = {
  recording: "is recording",
  waiting: "waits for the device",
  ended: "has ended",
  failed: "has failed",
};

interface RecordingRowProps {
  recording: Recording;
  desk: RecordingDesk;
  /** Not as many are played as may be. */
  mayPlay: boolean;
}

function RecordingRow({ recording, desk, mayPlay }: RecordingRowProps) {
  const { name, device, service, state, standing, problem, beginMs, seconds, bytes, files } = recording;
  const [asks, setAsks] = useState(false);
  return (
    <li class="device" data-recording={name} data-state={state}>
      <div class="device-head">
        <h2 class="place-name">
          {device} · {service}
        </h2>
        <span>{t(STATES[state] ?? state)}</span>
      </div>
      <dl class="device-facts">
        <Fact name={t("Begun")} value={new Date(beginMs).toLocaleString(language)} />
        <Fact name={t("Duration")} value={span(seconds * 1000)} />
        <Fact name={t("Size")} value={bytesText(bytes)} />
      </dl>
      {problem !== "" && <p class="device-trouble">{sentence(problem)}</p>}
      <div class="row-line">
        {files.map((file, index) => (
          <a key={file.name} class="button" href={fileAddress(file)} download={file.name}>
            {files.length === 1 ? t("Download") : t("Download part {0}", index + 1)}
          </a>
        ))}
        {files.length > 0 && <PlayButtons recording={recording} desk={desk} mayPlay={mayPlay} />}
        {isUnderWay(recording) && !standing && (
          <button class="button" type="button" onClick={() => void desk.end(recording)}>
            {t("Stop recording")}
          </button>
        )}
        {!isUnderWay(recording) && (
          // The second click of two takes back the first: what deletes stands elsewhere.
          <button
            class="button"
            type="button"
            onClick={({ currentTarget }) => {
              currentTarget.focus(); // which not every browser does by itself
              setAsks(!asks);
            }}
          >
            {asks ? t("Keep it") : t("Delete")}
          </button>
        )}
        {!isUnderWay(recording) && asks && (
          <button class="button" type="button" onClick={() => void desk.remove(recording)}>
            {t("Delete it for good")}
          </button>
        )}
      </div>
    </li>
  );
}

function PlayButtons({ recording, desk, mayPlay }: RecordingRowProps) {
  const { replay, service } = recording;
  const [isBeginning, setBeginning] = useState(false);
  const play = async (): Promise<void> => {
    setBeginning(true);
    await desk.play(recording);
    setBeginning(false);
  };
  if (replay === "")
    return (
      <button
        class="button"
        type="button"
        disabled={!mayPlay || isBeginning}
        title={mayPlay ? undefined : t("{0} recordings are played already; stop one of them first", MOST_REPLAYS)}
        onClick={() => void play()}
      >
        {t("Play")}
      </button>
    );
  return (
    <>
      <a class="button" href={formatRoute(replay, service)}>
        {t("Show the recording")}
      </a>
      <button class="button" type="button" onClick={() => void desk.endPlaying(recording)}>
        {t("Stop playing")}
      </button>
    </>
  );
}

function Fact({ name, value }: { name: string; value: string }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}
