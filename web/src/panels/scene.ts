// The picture of a 3-D panel: chains of links, the shapes of a model, frames with their axes, a floor of squares. Drawn only when
// something has changed. Layer: web/panels. The one file that imports three.js, which is loaded with the panel.

import {
  AxesHelper,
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  CylinderGeometry,
  DirectionalLight,
  GridHelper,
  Group,
  HemisphereLight,
  Mesh,
  MeshLambertMaterial,
  PerspectiveCamera,
  Points as PointCloud,
  PointsMaterial,
  Quaternion,
  Scene,
  SphereGeometry,
  TOUCH,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Palette } from "../chart/palette";
import type { Frame, Pose } from "../values/frames";
import type { Points } from "../values/points";
import type { Body, Shape } from "../values/urdf";

export type View = "corner" | "above" | "front" | "side";

const VIEWS: Readonly<Record<View, readonly [x: number, y: number, z: number]>> = {
  corner: [1, -1.2, 0.9],
  above: [0, -0.001, 1],
  front: [1, 0, 0],
  side: [0, -1, 0],
};
const SMALLEST_M = 0.3;
const POINT_PX = 2;
const FLOOR_SQUARES = 20;
const UP = new Vector3(0, 1, 0); // along which cylinders lie
const UP_TO_Z = new Quaternion().setFromUnitVectors(UP, new Vector3(0, 0, 1));

export class Picture {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(40, 1, 0.001, 1000);
  readonly #controls: OrbitControls;
  readonly #chains = new Group();
  readonly #bodies = new Group();
  readonly #frames = new Group();
  readonly #linkMaterial = new MeshLambertMaterial();
  readonly #jointMaterial = new MeshLambertMaterial();
  readonly #cloud = new PointCloud(
    new BufferGeometry(),
    new PointsMaterial({ size: POINT_PX, sizeAttenuation: false }),
  );
  readonly #round = new SphereGeometry(1, 20, 12);
  readonly #tube = new CylinderGeometry(1, 1, 1, 20);
  readonly #block = new BoxGeometry(1, 1, 1);
  readonly #resized: ResizeObserver;
  #floor: GridHelper | null = null;
  #line = "gray";
  #radius = 0;
  #isLookedAt = false;
  #shown = "";
  #frame = 0;
  #resizing = 0;

  /** @throws Error where the browser draws no 3-D pictures. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    const sun = new DirectionalLight(0xffffff, 1.6);
    sun.position.set(1, -2, 4);
    const lights = [new HemisphereLight(0xffffff, 0x8899aa, 1.8), sun];
    this.#scene.add(...lights, this.#chains, this.#bodies, this.#frames, this.#cloud);
    this.#camera.up.set(0, 0, 1); // as robots have it
    this.#controls = new OrbitControls(this.#camera, canvas);
    // One finger scrolls the page, as over a map: a panel may fill the screen of a phone.
    this.#controls.touches = { ONE: null, TWO: TOUCH.DOLLY_ROTATE };
    canvas.style.touchAction = "pan-x pan-y"; // OrbitControls has set "none"
    canvas.addEventListener("touchstart", keepPair, { passive: false });
    canvas.addEventListener("touchmove", keepPair, { passive: false });
    this.#controls.addEventListener("change", this.#redraw);
    // In a frame of its own, as every change of layout that an observer asks for: within one, WebKit calls it an error.
    this.#resized = new ResizeObserver(() => {
      cancelAnimationFrame(this.#resizing);
      this.#resizing = requestAnimationFrame(() => this.#resize());
    });
    this.#resized.observe(canvas);
  }

  colour(palette: Palette): void {
    this.#linkMaterial.color = new Color(palette.series[1] ?? palette.ink);
    this.#jointMaterial.color = new Color(palette.accent);
    this.#cloud.material.color = new Color(palette.series[0] ?? palette.accent);
    this.#line = palette.line;
    this.#layFloor();
    this.#redraw();
  }

  /** `chains`: the poses of each from its base to its flange. The first ones that come are looked at whole. */
  show(chains: readonly (readonly Pose[])[], frames: readonly Frame[], bodies: readonly Body[]): void {
    const shown = JSON.stringify([chains, frames, bodies]);
    if (shown === this.#shown) return; // a robot that stands still costs nothing
    this.#shown = shown;
    const poses = [...chains.flat(), ...[...frames, ...bodies].map(({ pose }) => pose)];
    this.#makeRoom(Math.max(0, ...poses.map(({ at }) => Math.hypot(...at))));
    this.#chains.clear();
    for (const chain of chains) this.#addChain(chain);
    this.#bodies.clear();
    for (const body of bodies) this.#bodies.add(this.#makeBody(body));
    this.#showFrames([...chains.flatMap((chain) => chain.at(-1) ?? []), ...frames.map(({ pose }) => pose)]);
    if (poses.length > 0) this.#lookAtFirst();
    this.#redraw();
  }

  /** Instead of those before. */
  showPoints(points: Points): void {
    this.#cloud.geometry.dispose(); // the next ones may be more
    this.#cloud.geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(points, 3));
    this.#cloud.geometry.computeBoundingSphere();
    const { center, radius } = this.#cloud.geometry.boundingSphere ?? { center: new Vector3(), radius: 0 };
    this.#makeRoom(center.length() + radius);
    if (points.length > 0) this.#lookAtFirst();
    this.#redraw();
  }

  /** Everything, from there. */
  look(from: View): void {
    const distance = Math.max(this.#radius, SMALLEST_M) * 3.2;
    this.#controls.target.set(0, 0, this.#radius / 3);
    this.#camera.position
      .set(...VIEWS[from])
      .normalize()
      .multiplyScalar(distance)
      .add(this.#controls.target);
    this.#controls.update();
    this.#redraw();
  }

  dispose(): void {
    cancelAnimationFrame(this.#frame);
    this.#frame = -1; // nothing is drawn any more
    this.#resized.disconnect();
    cancelAnimationFrame(this.#resizing);
    this.canvas.removeEventListener("touchstart", keepPair);
    this.canvas.removeEventListener("touchmove", keepPair);
    this.#controls.dispose();
    this.#floor?.dispose();
    for (const axes of this.#frames.children) (axes as AxesHelper).dispose();
    const { geometry, material } = this.#cloud;
    for (const each of [
      this.#round,
      this.#tube,
      this.#block,
      this.#linkMaterial,
      this.#jointMaterial,
      geometry,
      material,
    ])
      each.dispose();
    this.#renderer.dispose();
  }

  #makeRoom(radius: number): void {
    if (radius <= this.#radius * 1.2 && this.#radius > 0) return;
    this.#radius = Math.max(SMALLEST_M, radius);
    this.#layFloor();
  }

  #lookAtFirst(): void {
    if (this.#isLookedAt) return;
    this.#isLookedAt = true;
    this.look("corner");
  }

  #addChain(poses: readonly Pose[]): void {
    const thickness = this.#radius * 0.025;
    poses.forEach(({ at }, i) => {
      const isJoint = i > 0 && i < poses.length - 1;
      if (isJoint) {
        const joint = new Mesh(this.#round, this.#jointMaterial);
        joint.position.set(...at);
        joint.scale.setScalar(thickness * 1.6);
        this.#chains.add(joint);
      }
      const next = poses[i + 1];
      if (!next) return;
      const along = new Vector3(...next.at).sub(new Vector3(...at));
      const length = along.length();
      if (length === 0) return;
      const link = new Mesh(this.#tube, this.#linkMaterial);
      link.scale.set(thickness, length, thickness);
      link.position.set(...at).addScaledVector(along, 0.5);
      link.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
      this.#chains.add(link);
    });
  }

  #makeBody({ shape, pose: { at, turn } }: Body): Mesh {
    const [w, x, y, z] = turn;
    const body = new Mesh(this.#geometryOf(shape), this.#linkMaterial);
    body.position.set(...at);
    body.quaternion.set(x, y, z, w);
    if (shape.kind === "box") body.scale.set(...shape.size);
    else if (shape.kind === "sphere") body.scale.setScalar(shape.radius);
    else {
      body.scale.set(shape.radius, shape.length, shape.radius);
      body.quaternion.multiply(UP_TO_Z);
    }
    return body;
  }

  #geometryOf({ kind }: Shape): BufferGeometry {
    return { box: this.#block, cylinder: this.#tube, sphere: this.#round }[kind];
  }

  #showFrames(poses: readonly Pose[]): void {
    while (this.#frames.children.length > poses.length) {
      const axes = this.#frames.children.at(-1) as AxesHelper;
      this.#frames.remove(axes);
      axes.dispose();
    }
    poses.forEach(({ at, turn: [w, x, y, z] }, i) => {
      const axes = this.#frames.children[i] ?? new AxesHelper(1);
      if (!axes.parent) this.#frames.add(axes);
      axes.position.set(...at);
      axes.setRotationFromQuaternion(new Quaternion(x, y, z, w));
      axes.scale.setScalar(this.#radius * 0.2);
    });
  }

  #layFloor(): void {
    if (this.#floor) {
      this.#scene.remove(this.#floor);
      this.#floor.dispose();
    }
    const squares = Math.max(1, Math.ceil((this.#radius * 2) / (FLOOR_SQUARES * 0.1))); // sides of 0.1 m, 0.2 m, ...
    this.#floor = new GridHelper(FLOOR_SQUARES * squares * 0.1, FLOOR_SQUARES, this.#line, this.#line);
    this.#floor.rotation.x = Math.PI / 2;
    this.#scene.add(this.#floor);
  }

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#redraw();
  }

  readonly #redraw = (): void => {
    if (this.#frame !== 0) return;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = 0;
      this.#renderer.render(this.#scene, this.#camera);
    });
  };
}

/** Two fingers turn and zoom the picture, and not the page as well. */
function keepPair(event: TouchEvent): void {
  if (event.touches.length > 1 && event.cancelable) event.preventDefault();
}
