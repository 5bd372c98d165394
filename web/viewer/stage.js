// One object on the canvas, lit, with a camera to turn around it. Draws only when something changed.
import {
  Box3, Color, DirectionalLight, MeshBasicMaterial, MeshNormalMaterial, PerspectiveCamera, PMREMGenerator, Scene,
  Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';

const OVERRIDES = {
  shaded: null,
  normals: new MeshNormalMaterial(),
  wireframe: new MeshBasicMaterial({ color: 0xe2b069, wireframe: true }),
};
const FROM = new Vector3(0.35, 0.25, 1).normalize();  // where the camera starts, seen from the object

export class Stage {
  constructor(canvas) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new Scene();
    this.scene.background = new Color(0x17181a);
    const environment = new PMREMGenerator(this.renderer).fromScene(new RoomEnvironment(), 0.04);
    this.scene.environment = environment.texture;
    this.scene.environmentIntensity = 0.22;
    this.camera = new PerspectiveCamera(32, 1, 0.01, 100);
    this.light = new DirectionalLight(0xfff4e6, 2.4);
    this.camera.add(this.light, this.light.target);
    this.scene.add(this.camera);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.object = null;
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  show(object) {
    if (this.object) dispose(this.object);
    this.object?.removeFromParent();
    this.object = object;
    this.scene.add(object);
    this.frame();
    this.draw();
  }

  // Puts the camera so that the object fits the canvas.
  frame() {
    const box = new Box3().setFromObject(this.object);
    if (box.isEmpty()) return;
    const center = box.getCenter(new Vector3());
    const radius = Math.max(box.getSize(new Vector3()).length() / 2, 1e-9);
    const half = Math.min(this.camera.fov, this.camera.fov * this.camera.aspect) * Math.PI / 360;
    const distance = 0.85 * radius / Math.sin(half);
    this.camera.near = distance / 100;
    this.camera.far = distance * 10;
    this.camera.position.copy(center).addScaledVector(FROM, distance);
    this.camera.updateProjectionMatrix();
    this.light.position.set(-0.9 * distance, 0.9 * distance, 0);
    this.light.target.position.set(0, 0, -distance);
    this.controls.target.copy(center);
    this.controls.update();
  }

  setMode(mode) {
    this.scene.overrideMaterial = OVERRIDES[mode];
    this.draw();
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
  }
}

function dispose(object) {
  object.traverse(node => {
    node.geometry?.dispose();
    for (const material of [node.material ?? []].flat()) {
      for (const value of Object.values(material)) if (value?.isTexture) value.dispose();
      material.dispose();
    }
  });
}
