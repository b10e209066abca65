// The cell: what stands outside the levels, in space and as a drawing, at the tick that everybody looks at.

import { Refusal } from "./bus.js";
import { colour, make, spoken } from "./make.js";
import { OrbitControls } from "./vendor/three/OrbitControls.js";
import * as THREE from "./vendor/three/three.module.js";

const [FLOOR_M, GRID_M, LEAST_M] = [2, 0.2, 0.05]; // LEAST_M: half the width from which on what stands is called by its name
const FROM = { front: ["from the front", [1, 0, 0.12]], left: ["from the left", [0, -1, 0.12]], above: ["from above", [0, -0.001, 1]] }; // where the eye is, of the middle

export function mount(root, bus) {
  const whole = "the whole";
  const look = make("select", { "aria-label": "What the eye looks at" });
  const trace = make("select", { "aria-label": "Whose way is drawn" });
  const how = make("select", { "aria-label": "How it is drawn" }, make("option", { value: "space" }, "in space"), make("option", { value: "drawing" }, "as a drawing"),
    make("option", { value: "projections" }, "in projections"));
  const note = make("span", { class: "soft grow" });
  const canvas = make("canvas", { tabindex: "0", "aria-label": "The cell in space; arrow keys turn it, + and - go nearer and farther", "data-keys": "own" });
  const plates = make("div", { "aria-hidden": "true" });
  const named = make("input", { type: "checkbox", checked: true, onchange: () => soon() });
  const stage = make("div", { class: "stage" }, canvas, plates);
  const drawing = make("div", { class: "drawing scroll", hidden: true, tabindex: "0", role: "img" });
  const why = make("div", { class: "closed pre", role: "status", hidden: true });
  root.append(make("div", { class: "bar" }, how, make("label", {}, "Look at ", look), make("label", {}, "Trace ", trace), make("label", { title: "Names of what stands" }, named, " names"), note), stage, drawing, why);

  let state = { space: false, drawn: false, why: "" };
  let space = null, renderer = null, shown = true, asking = false, wanted = "", got = "";

  // --- space ---

  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(42, 1, 0.01, 60);
  camera.up.set(0, 0, 1);
  const sky = new THREE.HemisphereLight(0xffffff, 0x8a8f94, 1.5);
  const sun = new THREE.DirectionalLight(0xfff4e2, 2.1);
  sun.position.set(1.5, -2, 4);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  Object.assign(sun.shadow.camera, { left: -FLOOR_M, right: FLOOR_M, top: FLOOR_M, bottom: -FLOOR_M, near: 0.5, far: 12 });
  sun.shadow.normalBias = 0.01;
  const back = new THREE.DirectionalLight(0xdfe9ff, 0.7); // so that what is turned away is seen, in the dark theme too
  back.position.set(-2, 2, 1.5);
  const shade = new THREE.Mesh(new THREE.PlaneGeometry(4 * FLOOR_M, 4 * FLOOR_M), new THREE.ShadowMaterial({ opacity: 0.22 }));
  shade.position.z = 0.0008;
  shade.receiveShadow = true;
  scene.add(sky, sun, back, shade);
  const grid = new THREE.GridHelper(2 * FLOOR_M, 2 * FLOOR_M / GRID_M);
  grid.rotation.x = Math.PI / 2;
  grid.position.z = 0.001;
  const way = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xd12f8a }));
  way.frustumCulled = false;
  const room = new THREE.Group();
  scene.add(grid, way, room);
  let groups = [], controls = null;

  function begin() {
    if (renderer) return true;
    try {
      renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    } catch {
      return false;
    }
    renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    controls = new OrbitControls(camera, canvas);
    controls.listenToKeyEvents(canvas);
    controls.addEventListener("change", soon);
    canvas.addEventListener("keydown", (event) => {
      const by = { "+": 0.87, "=": 0.87, "-": 1.15 }[event.key];
      if (!by) return;
      event.preventDefault();
      camera.position.sub(controls.target).multiplyScalar(by).add(controls.target);
      soon();
    });
    new ResizeObserver(size).observe(stage);
    size();
    return true;
  }

  function size() {
    const { clientWidth: wide, clientHeight: high } = stage;
    if (!renderer || !wide || !high) return;
    renderer.setSize(wide, high, false);
    camera.aspect = wide / high;
    camera.updateProjectionMatrix();
    soon();
  }

  let due = false;
  function soon() {
    if (due || !renderer || !shown) return;
    due = true;
    requestAnimationFrame(() => { due = false; controls.update(); renderer.render(scene, camera); label(); root.dataset.frames = Number(root.dataset.frames ?? 0) + 1; });
  }

  const eye = new THREE.Raycaster();

  /** Names of what stands fixed, above it: the larger first, and none over another or of what is hidden. */
  function label() {
    const taken = [], { clientWidth: wide, clientHeight: high } = stage;
    for (const one of plates.children) {
      const [width, height] = [9 + 7.2 * one.textContent.length, 18];
      const boxes = named.checked ? one.tops.map((top) => [top, top.clone().project(camera)]).filter(([top, { z }]) => z < 1 && seen(top, one.of))
        .map(([, place]) => [(place.x + 1) / 2 * wide, (1 - place.y) / 2 * high]).map(([x, y]) => [x - width / 2, y - height - 2, x + width / 2, y - 2]) : [];
      const box = boxes.find(([left, up, right, down]) => left > 0 && up > 0 && right < wide && down < high && !taken.some((other) => left < other[2] && other[0] < right && up < other[3] && other[1] < down));
      one.hidden = !box;
      if (!box) continue;
      taken.push(box);
      one.style.transform = `translate(${Math.round(box[0])}px, ${Math.round(box[1])}px)`;
    }
  }

  /** Whether nothing stands before a point of a shape. */
  function seen(point, of) {
    const way = point.clone().sub(camera.position), far = way.length();
    eye.set(camera.position, way.normalize());
    return !eye.intersectObject(room, true).some(({ distance, object }) => distance < far - 0.02 && object !== of && !object.userData.endless);
  }

  /** Places on top of a shape: its middle, and near its edges. */
  function topsOf(mesh) {
    const { min, max } = new THREE.Box3().setFromObject(mesh), middle = min.clone().add(max).multiplyScalar(0.5);
    return [[0, 0], [0.35, 0], [-0.35, 0], [0, 0.35], [0, -0.35]].map(([x, y]) => new THREE.Vector3(middle.x + x * (max.x - min.x), middle.y + y * (max.y - min.y), max.z));
  }

  /** A plate for each shape that has a name, stands fixed and is no small thing, the largest first. */
  function platesOf(shapes) {
    const fixed = shapes.map((one, at) => [one, solids[at]]).filter(([{ body, kind, name, size_m: [a, b] }]) => body < 0 && kind !== "plane" && name && Math.max(a, b) >= LEAST_M && a * b > 0)
      .sort(([one], [other]) => other.size_m[0] * other.size_m[1] - one.size_m[0] * one.size_m[1]);
    plates.replaceChildren(...fixed.map(([{ name }, mesh]) => Object.assign(make("span", { class: "plate" }, name.replaceAll("_", " ")), { of: mesh, tops: topsOf(mesh) })));
  }

  let solids = [];
  function build(answer) {
    space = answer;
    room.clear();
    groups = answer.bodies.map(() => new THREE.Group());
    room.add(...groups);
    solids = answer.shapes.map(solid);
    answer.shapes.forEach(({ body }, at) => (body < 0 ? room : groups[body]).add(solids[at]));
    platesOf(answer.shapes);
    const option = (value, text) => make("option", { value }, text);
    const bodies = answer.bodies.map((name, at) => option(at, name || `body ${at}`));
    look.replaceChildren(option("", whole), ...Object.entries(FROM).map(([key, [text]]) => option(key, text)), ...bodies.map((one) => one.cloneNode(true)));
    shade.visible = grid.visible = answer.shapes.some(({ kind }) => kind === "plane");
    trace.replaceChildren(option("", "none"), ...bodies);
    const hand = answer.bodies.findIndex((name) => /hand|grip|tool|plate/i.test(name));
    if (hand >= 0) trace.value = String(hand);
  }

  function overview(towards = [0.75, -0.62, 0.5]) {
    const box = new THREE.Box3();
    for (const one of room.children) if (!one.userData.endless) box.expandByObject(one);
    const middle = box.isEmpty() ? new THREE.Vector3() : box.getCenter(new THREE.Vector3());
    const far = box.isEmpty() ? 2 : Math.max(0.3, box.getSize(new THREE.Vector3()).length());
    controls.target.copy(middle);
    const away = look.value in FROM ? 1.25 * far : far;
    camera.position.copy(middle).add(new THREE.Vector3(...towards).multiplyScalar(away));
    sun.target.position.copy(middle);
    sun.position.copy(middle).add(new THREE.Vector3(1.5, -2, 4));
    scene.add(sun.target);
    grid.material.opacity = 0.5;
  }

  function place(poses) {
    groups.forEach((group, at) => {
      const [x, y, z, w, i, j, k] = poses.slice(7 * at, 7 * at + 7);
      group.position.set(x, y, z);
      group.quaternion.set(i, j, k, w);
    });
    follow();
    soon();
  }

  function follow() {
    if (look.value === "" || !groups[look.value]) return;
    const to = groups[look.value].position;
    camera.position.add(to).sub(controls.target);
    controls.target.copy(to);
  }

  look.addEventListener("change", () => {
    if (look.value === "" || look.value in FROM) overview(FROM[look.value]?.[1]);
    else {
      const to = groups[look.value].position;
      controls.target.copy(to);
      camera.position.copy(to).add(new THREE.Vector3(0.32, -0.3, 0.16));
    }
    soon();
  });
  trace.addEventListener("change", () => { way.geometry.setFromPoints([]); wanted = ""; fetch(); });
  how.addEventListener("change", arrange);

  // --- what is there at a tick ---

  async function fetch() {
    const { tick } = bus.selection;
    const run = bus.latest("run");
    if (!shown || !run?.open || tick === null) return;
    const key = `${run.source} ${run.key ?? ""} ${tick} ${showing()} ${how.value} ${trace.value} ${look.value}`;
    wanted = key;
    if (asking || got === key) return;
    asking = true;
    try {
      if (showing() === "drawing") await drawn(tick);
      else await posed(tick);
      said("");
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      said(error.message);
    } finally {
      asking = false;
      got = key;
      root.dataset.tick = tick;
    }
    if (wanted !== key) fetch();
  }

  async function posed(tick) {
    if (!space) {
      build(await bus.ask("cell.space"));
      place((await bus.ask("cell.poses", { tick })).poses);
      overview();
    } else {
      place((await bus.ask("cell.poses", { tick })).poses);
    }
    if (trace.value === "") return;
    const { points } = await bus.ask("cell.trace", { tick, body: Number(trace.value) });
    way.geometry.dispose();
    way.geometry = new THREE.BufferGeometry().setFromPoints(points.map(([x, y, z]) => new THREE.Vector3(x, y, z)));
    soon();
  }

  async function drawn(tick) {
    const { svg, caption } = await bus.ask("cell.drawing", { tick, projected: how.value === "projections" });
    const picture = new DOMParser().parseFromString(svg, "image/svg+xml").documentElement;
    drawing.replaceChildren(document.adoptNode(picture), ...caption.map((text) => make("p", {}, ...spoken(text))));
    drawing.setAttribute("aria-label", caption.join(" "));
  }

  const live = () => bus.latest("run")?.source !== "log";
  const inSpace = () => state.space && live();
  const showing = () => (how.value === "space" && inSpace()) || !state.drawn ? "space" : "drawing";

  function said(text) {
    why.hidden = !text;
    why.replaceChildren(...spoken(text));
  }

  function arrange() {
    how.querySelector("[value=space]").disabled = !inSpace();
    for (const value of ["drawing", "projections"]) how.querySelector(`[value=${value}]`).disabled = !state.drawn;
    const now = showing();
    const there = now === "drawing" || inSpace();
    stage.hidden = now !== "space" || !there;
    drawing.hidden = now !== "drawing";
    for (const one of [look, trace]) one.disabled = now !== "space" || !there;
    if (!there) return said(live() ? state.why : "A log holds no poses, and this system has no drawing.");
    if (now === "space" && !begin()) {
      stage.hidden = true;
      return said("This browser cannot draw in space (WebGL).");
    }
    note.title = now === "space" ? "Drag to turn, wheel to go nearer" : "";
    note.textContent = now === "space" ? `squares of ${GRID_M * 1000} mm` : how.value === "projections" ? "lengths in mm" : how.value === "space" && state.space ? "a log holds no poses: drawn of what buffers say" : "";
    note.title = note.textContent;
    said("");
    size();
    got = "";
    return fetch();
  }

  function theme() {
    scene.background = new THREE.Color(colour("paper"));
    const dark = bus.latest("theme") === "dark";
    sky.intensity = dark ? 2.1 : 1.5; // a dark gripper is seen before a dark wall
    back.intensity = dark ? 1.6 : 0.7;
    shade.material.opacity = dark ? 0.45 : 0.22;
    grid.material.color?.set(colour("strong-edge"));
    grid.material.vertexColors = false;
    grid.material.transparent = true;
    grid.material.needsUpdate = true;
    soon();
  }

  const told = (now) => { state = now; space = null; arrange(); };
  bus.on("cell.state", told);
  let source = "";
  bus.on("run", (run) => { if (run.source !== source) { source = run.source; arrange(); } else fetch(); });
  bus.on("selection", (_, changed) => { if (changed?.has("tick")) fetch(); });
  bus.on("theme", theme);
  return { shown() { shown = true; size(); fetch(); }, hidden() { shown = false; } };
}

/** A shape as something to be drawn. */
function solid({ kind, size_m: [a, b, c], colour: [red, green, blue, opacity], at_m, turn: [w, i, j, k], mesh, name }) {
  const colour = new THREE.Color().setRGB(red, green, blue, THREE.SRGBColorSpace);
  const material = new THREE.MeshStandardMaterial({ color: colour, roughness: 0.75, metalness: 0.05, transparent: opacity < 1, opacity });
  const made = new THREE.Mesh(geometry(kind, [a, b, c], mesh), material);
  made.position.set(...at_m);
  made.quaternion.set(i, j, k, w);
  made.name = name;
  made.castShadow = kind !== "plane" && opacity === 1;
  made.receiveShadow = kind !== "plane";
  if (kind === "plane") {
    made.userData.endless = true;
    material.transparent = true;
    material.opacity = 0.25;
    material.depthWrite = false;
  }
  return made;
}

function geometry(kind, [a, b, c], mesh) {
  const upright = (one) => one.rotateX(Math.PI / 2); // three's lie along y, MuJoCo's along z
  if (kind === "box") return new THREE.BoxGeometry(2 * a, 2 * b, 2 * c);
  if (kind === "ball") return new THREE.SphereGeometry(a, 32, 20);
  if (kind === "ellipsoid") return new THREE.SphereGeometry(1, 32, 20).scale(a, b, c);
  if (kind === "cylinder") return upright(new THREE.CylinderGeometry(a, a, 2 * b, 40));
  if (kind === "capsule") return upright(new THREE.CapsuleGeometry(a, 2 * b, 12, 32));
  if (kind === "plane") return new THREE.PlaneGeometry(2 * (a || FLOOR_M), 2 * (b || FLOOR_M));
  const made = new THREE.BufferGeometry();
  made.setAttribute("position", new THREE.Float32BufferAttribute(mesh.corners_m, 3));
  made.setIndex(mesh.faces);
  const flat = made.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}
