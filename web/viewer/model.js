// From the bytes of a .glb, .gltf or bare .relief file to a three.js object and its figures.
import { BufferAttribute, BufferGeometry, Mesh, MeshStandardMaterial } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { linearColors, ReliefPatchCompression } from 'relief-gltf/three';

const clay = () => new MeshStandardMaterial({ color: 0xc9c3b8, roughness: 0.62, metalness: 0 });
const painted = () => new MeshStandardMaterial({ vertexColors: true, roughness: 0.8, metalness: 0 });
const materialOf = geometry => (geometry.attributes.color ? painted() : clay());

export async function loadModel(bytes, base, decoder) {
  const start = String.fromCharCode(...bytes.subarray(0, 4));
  if (start.startsWith('RLF')) return loadStream(bytes, decoder);
  if (start === 'glTF' || start.trimStart().startsWith('{')) return loadGltf(bytes, base, decoder);
  throw new Error('neither glTF nor a Relief stream');
}

function loadStream(bytes, decoder) {
  const begin = performance.now();
  const mesh = decoder.decode(bytes);
  const milliseconds = performance.now() - begin;
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(mesh.positions, 3));
  geometry.setAttribute('normal', new BufferAttribute(mesh.normals, 3));
  if (mesh.colors) geometry.setAttribute('color', new BufferAttribute(linearColors(mesh.colors), 4, true));
  geometry.setIndex(new BufferAttribute(mesh.indices, 1));
  return {
    object: new Mesh(geometry, materialOf(geometry)),
    streams: { count: 1, bytes: bytes.length, milliseconds },
    vertices: mesh.vertexCount,
    triangles: mesh.triangleCount,
  };
}

async function loadGltf(bytes, base, decoder) {
  const loader = new GLTFLoader();
  let plugin;
  loader.register(parser => (plugin = new ReliefPatchCompression(parser, decoder)));
  const gltf = await loader.parseAsync(bytes.buffer, base);
  let vertices = 0, triangles = 0;
  gltf.scene.traverse(object => {
    const { geometry } = object;
    if (geometry) vertices += geometry.attributes.position.count;
    if (!object.isMesh) return;
    triangles += (geometry.index ?? geometry.attributes.position).count / 3;
    const at = gltf.parser.associations.get(object);
    const primitive = gltf.parser.json.meshes[at?.meshes]?.primitives[at.primitives];
    if (primitive && primitive.material === undefined) object.material = materialOf(geometry);
  });
  const { streams, bytes: streamBytes, milliseconds } = plugin.stats;
  return { object: gltf.scene, streams: { count: streams, bytes: streamBytes, milliseconds }, vertices, triangles };
}
