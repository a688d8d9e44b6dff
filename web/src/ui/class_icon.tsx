// What a device is, as a picture: by the types of its services, the first that is known. Layer: web/ui.

import type { ComponentChildren } from "preact";

const CLASSES: readonly [types: RegExp, picture: ComponentChildren][] = [
  [/robotics\.robot\./, <path d="M6 28h14M13 28v-7l-5-7 8-8 6 5" key="arm" />],
  [/robotics\.tool\./, <path d="M16 4v8M8 12h16M8 12v8l4 6M24 12v8l-4 6" key="tool" />],
  [/servo/i, <path d="M16 5v11l7 6M16 5a11 11 0 1 0 11 11" key="servo" />],
  [/camera|webcam|imaging/i, <path d="M4 10h6l3-4h6l3 4h6v16H4ZM16 13a5 5 0 1 0 .1 0" key="camera" />],
  [/create/i, <path d="M16 5a11 11 0 1 0 .1 0M7 16h2M23 16h2M16 10v6M10 9q6-4 12 0" key="rover" />],
  [
    /joystick|gamepad/i,
    <path d="M10 10h12a7 7 0 0 1 0 14l-3-3h-6l-3 3a7 7 0 0 1 0-14M10 14v5M8 16.5h5M22 15v3" key="pad" />,
  ],
  [/laser|lidar/i, <path d="M16 26V16M6 16a10 10 0 0 1 20 0M10 16a6 6 0 0 1 12 0M12 26h8" key="scanner" />],
  [/sensor/i, <path d="M4 18h5l3-9 5 15 4-10 2 4h5" key="sensor" />],
];
const OTHER = <path d="M16 4l11 6v12l-11 6-11-6V10ZM5 10l11 6 11-6M16 16v12" />;

export function ClassIcon({ types }: { types: readonly string[] }) {
  const [, picture = OTHER] = CLASSES.find(([known]) => types.some((type) => known.test(type))) ?? [];
  return (
    <svg class="class-icon" width="32" height="32" viewBox="0 0 32 32" aria-hidden="true" focusable="false">
      {picture}
    </svg>
  );
}
