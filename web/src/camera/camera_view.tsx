// Live pictures of the webcam service behind the same gateway: the packets of its `FrameStream`, or where a camera has no
// such pipe one `CaptureFrame` after the other.
// Layer: web/camera.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import { devicesOf } from "../gateway/devices";
import { linkTo } from "../gateway/link_to";
import type { DeviceList, GatewayState } from "../gateway/devices";
import type { Link } from "../robot/link";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { drawFrame } from "./draw_frame";
import { newestOf } from "./newest";
import { Snapshot } from "./snapshot";
import { useAge } from "../ui/use_age";
import { clockTime } from "../ui/words";

const PAUSE_MS = 80; // between frames, so that the camera never takes the line from the robot

interface Place {
  device: string;
  service: string;
}

/** The robot's own webcam service, else the first one that another device offers. */
function findCamera(gateway: GatewayState, robot: string): Place | null {
  const found = (devicesOf(gateway) ?? []).flatMap((device) =>
    device.services
      .filter((service) => service.type.endsWith(".WebcamHost"))
      .map((service) => ({ device: device.name, service: service.name })),
  );
  return found.find((place) => place.device === robot) ?? found[0] ?? null;
}

export function CameraView({ list, robot, shown }: { list: DeviceList; robot: string; shown: boolean }) {
  const gateway = useStore(list.state);
  const nowFound = findCamera(gateway, robot);
  // A camera that was there stays: its device may be away for a while, and its services with it.
  const [place, setPlace] = useState<Place | null>(null);
  useEffect(() => {
    if (nowFound && (place?.device !== nowFound.device || place.service !== nowFound.service)) {
      if (place === null || devicesOf(gateway)?.some((d) => d.name === place.device) === false) setPlace(nowFound);
    }
  }, [nowFound?.device, nowFound?.service]);
  return (
    <section class="panel camera" aria-labelledby="camera-title">
      <h2 id="camera-title" class="unseen">
        {t("Camera")}
      </h2>
      {place ? (
        <Camera key={`${place.device}/${place.service}`} place={place} list={list} shown={shown} />
      ) : (
        <NoCamera loading={gateway.kind === "loading"} />
      )}
    </section>
  );
}

function NoCamera({ loading }: { loading: boolean }) {
  return (
    <div class="camera-frame">
      <p class="camera-note">
        {loading ? t("Looking for a camera …") : t("No device behind this gateway offers a webcam service right now.")}
      </p>
    </div>
  );
}

function Camera({ place, list, shown }: { place: Place; list: DeviceList; shown: boolean }) {
  const [link, setLink] = useState<Link | null>(null);
  useEffect(() => {
    const { link: made, dispose } = linkTo(place.device, place.service, list);
    setLink(made);
    return dispose;
  }, [place.device, place.service, list]);
  return link && <Picture link={link} place={place} shown={shown} />;
}

function Picture({ link, place, shown }: { link: Link; place: Place; shown: boolean }) {
  const state = useStore(link.state);
  const remote = state.kind === "online" ? state.remote : null;
  const cameras = useCameras(remote);
  const [chosen, setChosen] = useState<number | null>(null);
  const index = chosen !== null && cameras.some((c) => c.index === chosen) ? chosen : (cameras[0]?.index ?? null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const { failure, hasFrame, size, age } = useFrames(canvas, remote, index, shown);
  const note =
    state.kind === "lost"
      ? t("No connection to {0} since {1}. Retrying by itself.", place.device, clockTime(state.since))
      : (failure ?? (hasFrame ? age && t("This picture is {0}.", age) : t("Waiting for the first picture …")));
  return (
    <>
      <div class={`camera-frame ${note !== null && hasFrame ? "is-stale" : ""}`}>
        <canvas
          key={index}
          ref={canvas}
          width={4}
          height={3}
          role="img"
          aria-label={t("Picture from camera {0}", cameras.find((c) => c.index === index)?.name ?? "")}
        />
        {note !== null && (
          <p class="camera-note" role={failure === null ? undefined : "alert"}>
            {note}
          </p>
        )}
      </div>
      <div class="camera-foot">
        {cameras.length > 1 ? (
          <label>
            <span class="unseen">{t("Camera")}</span>
            <select
              class="field"
              value={String(index)}
              onChange={(event) => setChosen(Number(event.currentTarget.value))}
            >
              {cameras.map((camera) => (
                <option key={camera.index} value={String(camera.index)}>
                  {camera.name}
                </option>
              ))}
            </select>
          </label>
        ) : (
          <span>{cameras[0]?.name ?? place.device}</span>
        )}
        <span class="note">{size}</span>
        {remote && index !== null && <Snapshot host={remote} index={index} />}
      </div>
    </>
  );
}

interface NamedCamera {
  index: number;
  name: string;
}

function useCameras(remote: Remote | null): readonly NamedCamera[] {
  const [cameras, setCameras] = useState<readonly NamedCamera[]>([]);
  useEffect(() => {
    if (!remote) return;
    let current = true;
    remote.get("WebcamNames").then(
      (names) => current && setCameras(readNames(names)),
      () => current && setCameras([{ index: 0, name: "camera 0" }]), // an older host without names still has its first
    );
    return () => void (current = false);
  }, [remote]);
  return cameras;
}

function readNames(names: unknown): NamedCamera[] {
  const entries = names instanceof Map ? [...names.entries()] : Object.entries(names ?? {});
  return entries
    .map(([index, name]) => ({ index: Number(index), name: String(name) }))
    .sort((a, b) => a.index - b.index);
}

interface Frames {
  failure: string | null;
  hasFrame: boolean;
  size: string;
  /** Of the picture; null while they come. */
  age: string | null;
}

const NO_FRAMES: Omit<Frames, "age"> = { failure: null, hasFrame: false, size: "" };

function useFrames(
  canvas: { current: HTMLCanvasElement | null },
  remote: Remote | null,
  index: number | null,
  shown: boolean,
): Frames {
  const [frames, setFrames] = useState(NO_FRAMES);
  const drawnAt = useRef<number | null>(null);
  const age = useAge(() => drawnAt.current);
  useEffect(() => {
    drawnAt.current = null;
    setFrames(NO_FRAMES);
  }, [index]);
  useEffect(() => {
    if (!remote || index === null || !shown) return;
    const on = canvas.current; // each camera has a canvas of its own: what comes late from another one is drawn where nobody sees it
    const stop = new AbortController();
    const follow = async (): Promise<void> => {
      const camera = await remote.child("Webcams", index);
      for await (const frame of framesOf(camera, stop.signal)) {
        if (document.hidden) continue;
        const size = await drawFrame(on, frame);
        if (stop.signal.aborted) return;
        drawnAt.current = performance.now();
        setFrames((old) => (old.failure === null && old.size === size ? old : { failure: null, hasFrame: true, size }));
        await new Promise(requestAnimationFrame); // what has come while it was drawn is taken first
      }
    };
    const keepFollowing = async (): Promise<void> => {
      while (!stop.signal.aborted) {
        await follow().catch((error: unknown) => {
          if (!stop.signal.aborted) setFrames((old) => ({ ...old, failure: explain(error) }));
        });
        await new Promise((resolve) => setTimeout(resolve, 1000));
      }
    };
    void keepFollowing();
    return () => stop.abort();
  }, [remote, index, shown]);
  return { ...frames, age };
}

async function* framesOf(camera: Remote, signal: AbortSignal): AsyncGenerator<unknown, void> {
  if (camera.has("FrameStream", "pipe")) {
    const stream = camera.pipe("FrameStream", signal);
    await camera.call("StartStreaming", []);
    yield* newestOf(stream);
    return;
  }
  while (!signal.aborted) {
    if (!document.hidden) yield await camera.call("CaptureFrame", []);
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
  }
}
