// The 3D view: true and estimated camera paths, objects, covariance ellipsoids, odometry points. z is up.
class Viewer {
  constructor(box, runs, timeline, indexIn) {
    this.runs = runs; this.timeline = timeline; this.indexIn = indexIn;
    this.layers = {};
    this.exaggeration = 1;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    box.append(this.renderer.domElement);
    this.canvas = this.renderer.domElement;
    this.canvas.setAttribute("aria-label", "3D view of cameras and objects; drag to turn");
    this.camera = new THREE.PerspectiveCamera(38, 4 / 3, 0.01, 200);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.build();
    this.reset();
    new ResizeObserver(() => this.resize(box)).observe(box);
    this.resize(box);
    timeline.onChange((index, source) => { if (source !== "state") this.show(index); });
    themeListeners.push(() => { this.build(); this.show(this.timeline.index); });
    this.show(0);
  }

  layer(name) {
    if (!this.layers[name]) this.layers[name] = { on: true };
    const group = new THREE.Group();
    group.visible = this.layers[name].on;
    this.layers[name].groups = [...(this.layers[name].groups || []), group];
    this.scene.add(group);
    return group;
  }
  setLayer(name, on) {
    this.layers[name].on = on;
    for (const group of this.layers[name].groups) group.visible = on;
    this.draw();
  }

  build() {
    for (const layer of Object.values(this.layers)) layer.groups = [];
    this.scene = new THREE.Scene();
    const sky = new THREE.HemisphereLight(0xffffff, 0x888888, 2.2);
    sky.position.set(0, 0, 1);
    const sun = new THREE.DirectionalLight(0xffffff, 1.3);
    sun.position.set(-1, -2, 3);
    this.scene.add(sky, sun);
    this.extent = this.measure();
    this.scene.add(this.grid());
    this.parts = this.runs.map((run, k) => this.buildRun(run, k));
  }

  measure() {
    const box = new THREE.Box3();
    const add = (pose, r) => {
      if (!pose) return;
      box.expandByPoint(new THREE.Vector3(pose[0] - r, pose[1] - r, pose[2] - r));
      box.expandByPoint(new THREE.Vector3(pose[0] + r, pose[1] + r, pose[2] + r));
    };
    for (const run of this.runs) {
      for (const list of [run.camera.estimated, run.camera.true]) list.forEach((p) => add(p, 0));
      for (const object of run.objects) for (const p of [object.true.find(Boolean), object.estimated.find(Boolean)]) add(p, 0.12);
    }
    if (box.isEmpty()) box.expandByPoint(new THREE.Vector3(-0.5, -0.5, 0)), box.expandByPoint(new THREE.Vector3(0.5, 0.5, 0.5));
    const size = box.getSize(new THREE.Vector3()).length(), centre = box.getCenter(new THREE.Vector3());
    const onDesk = this.runs.every((run) => run.world === "truth") && box.min.z > -0.15;
    return { size: Math.max(size, 0.2), centre, floor: onDesk ? 0 : box.min.z };
  }

  grid() {
    const step = 10 ** Math.floor(Math.log10(this.extent.size / 4)), n = Math.ceil(this.extent.size / step / 1.4);
    const grid = new THREE.GridHelper(2 * n * step, 2 * n, cssColor("--faint"), cssColor("--rule"));
    grid.rotation.x = Math.PI / 2;
    grid.position.set(Math.round(this.extent.centre.x / step) * step, Math.round(this.extent.centre.y / step) * step, this.extent.floor);
    this.gridStep_m = step;
    return grid;
  }

  path(poses, color, dashed) {
    const group = new THREE.Group();
    let piece = [];
    const finish = () => {
      if (piece.length > 3) {
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.Float32BufferAttribute(piece, 3));
        const material = dashed ? new THREE.LineDashedMaterial({ color, dashSize: 0.012, gapSize: 0.008 }) : new THREE.LineBasicMaterial({ color });
        const line = new THREE.Line(geometry, material);
        if (dashed) line.computeLineDistances();
        group.add(line);
      }
      piece = [];
    };
    for (const pose of poses) pose ? piece.push(pose[0], pose[1], pose[2]) : finish();
    finish();
    return group;
  }

  frustum(color) {
    const d = 0.055 * Math.max(0.6, Math.min(3, this.extent.size)), x = 0.62 * d, y = 0.46 * d;
    const corners = [[-x, -y, d], [x, -y, d], [x, y, d], [-x, y, d]];
    const lines = [];
    corners.forEach((c, k) => lines.push(0, 0, 0, ...c, ...c, ...corners[(k + 1) % 4]));
    lines.push(-0.3 * x, -y, d, 0, -1.35 * y, d, 0, -1.35 * y, d, 0.3 * x, -y, d);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(lines, 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color }));
  }

  // Surface and creases of an object; a small box where the shape is not known.
  body(object, color, opacity) {
    const group = new THREE.Group();
    let geometry = new THREE.BufferGeometry();
    const mesh = object.mesh && object.mesh.triangles.length ? object.mesh
      : { vertices: [-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1].map((v) => 0.03 * v),
          triangles: [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7] };
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(mesh.vertices, 3));
    geometry.setIndex(mesh.triangles);
    const edges = new THREE.EdgesGeometry(geometry, 28);
    geometry = geometry.toNonIndexed();
    geometry.computeVertexNormals();
    if (opacity > 0)
      group.add(new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({
        color, roughness: 0.85, transparent: true, opacity, side: THREE.DoubleSide, flatShading: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 })));
    group.add(new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ color })));
    return group;
  }

  ball(color) {
    const ball = new THREE.Mesh(new THREE.SphereGeometry(1, 28, 18), new THREE.MeshBasicMaterial({ color, transparent: true, opacity: 0.62, depthWrite: false, depthTest: false }));
    ball.renderOrder = 2;  // also within the objects
    ball.visible = false;
    return ball;
  }

  buildRun(run, k) {
    const second = k > 0, truth = cssColor("--truth"), cameraColor = cssColor("--camera");
    const part = { objects: [] };
    if (!second && run.camera.true.some(Boolean)) this.layer("true camera").add(this.path(run.camera.true, truth, false), (part.trueCamera = this.frustum(truth)));
    if (run.camera.estimated.some(Boolean)) this.layer("estimated camera").add(this.path(run.camera.estimated, cameraColor, second), (part.camera = this.frustum(cameraColor)));
    run.objects.forEach((object, i) => {
      const color = objectColor(i + (second ? run.objects.length : 0)), entry = { object };
      if (!second && object.true.some(Boolean)) this.layer("true objects").add((entry.truth = this.body(object, truth, 0)));
      if (object.estimated.some(Boolean)) this.layer("estimated objects").add((entry.body = this.body(object, color, 0.55)));
      if (object.ellipsoid.some(Boolean)) this.layer("tracker's ellipsoids").add((entry.ball = this.ball(color)));
      if (object.map && object.map.ellipsoid) this.layer("final map's ellipsoids").add((entry.mapBall = this.ball(cssColor("--map"))));
      part.objects.push(entry);
    });
    if (run.points.length) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(run.points, 3));
      this.layer("odometry points").add(new THREE.Points(geometry, new THREE.PointsMaterial({ color: cameraColor, size: 2, sizeAttenuation: false })));
    }
    return part;
  }

  static place(node, pose) {
    if (!node) return;
    node.visible = Boolean(pose);
    if (!pose) return;
    node.position.set(pose[0], pose[1], pose[2]);
    node.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
  }

  // Three sigma, times what the user asked for.
  placeBall(ball, pose, ellipsoid) {
    if (!ball) return;
    ball.visible = Boolean(pose && ellipsoid);
    if (!ball.visible) return;
    const s = 3 * this.exaggeration;
    ball.scale.set(...[0, 1, 2].map((i) => Math.max(1e-5, s * ellipsoid[i])));
    ball.position.set(pose[0], pose[1], pose[2]);
    ball.quaternion.set(pose[3], pose[4], pose[5], pose[6]).multiply(new THREE.Quaternion(...ellipsoid.slice(3)));
  }

  show(index) {
    this.runs.forEach((run, k) => {
      const i = this.indexIn(k, index), part = this.parts[k];
      Viewer.place(part.trueCamera, run.camera.true[i]);
      Viewer.place(part.camera, run.camera.estimated[i]);
      part.objects.forEach((entry, n) => {
        const { object } = entry, pose = object.estimated[i];
        Viewer.place(entry.truth, object.true[i]);
        Viewer.place(entry.body, pose);
        if (entry.body) {
          const color = new THREE.Color(object.held[i] === 0 ? cssColor("--lost") : objectColor(n + (k ? run.objects.length : 0)));
          entry.body.traverse((node) => node.material && node.material.color.copy(color));
        }
        this.placeBall(entry.ball, pose, object.ellipsoid[i]);
        if (object.map) this.placeBall(entry.mapBall, object.map.pose, object.map.ellipsoid);
      });
    });
    this.draw();
  }

  // Such that the ellipsoids are to be seen beside the objects.
  usefulExaggeration() {
    const sizes = [];
    for (const run of this.runs)
      for (const object of run.objects) {
        for (const e of object.ellipsoid) if (e) sizes.push(e[2]);
        if (object.map && object.map.ellipsoid) sizes.push(object.map.ellipsoid[2]);
      }
    if (!sizes.length) return null;
    sizes.sort((a, b) => a - b);
    return Math.max(1, Math.min(300, 0.045 / Math.max(1e-6, 3 * sizes[sizes.length >> 1])));
  }

  reset() {
    const { centre, size } = this.extent;
    this.controls.target.copy(centre);
    this.camera.position.set(centre.x + 0.44 * size, centre.y - 0.8 * size, centre.z + 0.52 * size);
    this.controls.update();
    this.draw();
  }
  resize(box) {
    const { clientWidth: w, clientHeight: h } = box;
    if (!w || !h) return;
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.draw();
  }
  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.renderer.render(this.scene, this.camera);
    });
  }
}
