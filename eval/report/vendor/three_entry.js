export { WebGLRenderer, Scene, PerspectiveCamera, Group, Mesh, LineSegments, Line, Points, BufferGeometry, BufferAttribute, Float32BufferAttribute,
  SphereGeometry, MeshStandardMaterial, MeshBasicMaterial, LineBasicMaterial, LineDashedMaterial, PointsMaterial, DirectionalLight, HemisphereLight, GridHelper, Color, Vector3,
  Quaternion, Matrix4, Box3, EdgesGeometry, DoubleSide } from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
