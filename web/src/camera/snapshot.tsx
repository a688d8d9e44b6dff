// One picture to keep: the camera puts it into its memory `buffer`, this page reads it from there.
// Layer: web/camera.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { drawFrame } from "./draw_frame";

export function Snapshot({ host, index }: { host: Remote; index: number }) {
  const [url, setUrl] = useState<string | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  useEffect(() => () => void (url && URL.revokeObjectURL(url)), [url]);
  const take = (): void => {
    setFailure(null);
    takeSnapshot(host, index).then(
      (picture) => setUrl(URL.createObjectURL(picture)),
      (error: unknown) => setFailure(explain(error)),
    );
  };
  return (
    <>
      <button class="button button-quiet" type="button" onClick={take}>
        {t("Snapshot")}
      </button>
      {url && (
        <a href={url} download="snapshot.png">
          {t("Save it")}
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

async function takeSnapshot(host: Remote, index: number): Promise<Blob> {
  const camera = await host.child("Webcams", index);
  const size = (await camera.call("CaptureFrameToBuffer", [])) as { width: number; height: number; step: number };
  const [length = 0] = await camera.dimensions("buffer");
  const data = await camera.read("buffer", [0], [length]);
  const canvas = document.createElement("canvas");
  await drawFrame(canvas, { ...size, data });
  return new Promise((resolve, reject) => {
    canvas.toBlob((picture) =>
      picture ? resolve(picture) : reject(new Error("this browser made no PNG of the picture")),
    );
  });
}
