// One picture to keep: the camera puts it into its memory `buffer`, this page reads it from there.
// Layer: web/camera.

import { useEffect, useState } from "preact/hooks";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { draw_frame } from "./draw_frame";

export function Snapshot({ host, index }: { host: Remote; index: number }) {
  const [url, set_url] = useState<string | null>(null);
  const [failure, set_failure] = useState<string | null>(null);
  useEffect(() => () => void (url && URL.revokeObjectURL(url)), [url]);
  const take = (): void => {
    set_failure(null);
    take_snapshot(host, index).then(
      (picture) => set_url(URL.createObjectURL(picture)),
      (error: unknown) => set_failure(explain(error)),
    );
  };
  return (
    <>
      <button class="button button-quiet" type="button" onClick={take}>
        Snapshot
      </button>
      {url && (
        <a href={url} download="snapshot.png">
          Save it
        </a>
      )}
      {failure !== null && (
        <span class="note" role="alert">
          {failure}
        </span>
      )}
    </>
  );
}

async function take_snapshot(host: Remote, index: number): Promise<Blob> {
  const camera = await host.child("Webcams", index);
  const size = (await camera.call("CaptureFrameToBuffer", [])) as { width: number; height: number; step: number };
  const [length = 0] = await camera.dimensions("buffer");
  const data = await camera.read("buffer", [0], [length]);
  const canvas = document.createElement("canvas");
  await draw_frame(canvas, { ...size, data });
  return new Promise((resolve, reject) => {
    canvas.toBlob((picture) => (picture ? resolve(picture) : reject(new Error("this browser made no PNG of the picture"))));
  });
}
