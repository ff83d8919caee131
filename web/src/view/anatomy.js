// The phantom's structures: meshes from the server, drawn as glass, cut by the axial section.

import { BufferAttribute, BufferGeometry, Group, Mesh } from "three";
import { coarser } from "./coarse.js";
import { inkOf, lookOf } from "./colours.js";
import { glass } from "./materials.js";
import { Slicer } from "./slices.js";
import { readStl } from "./stl.js";

export class Anatomy {
  constructor() {
    this.group = new Group();
    this.parts = []; // {name, role, look, mesh, data, slicer}
    this.isCoarse = false;
  }

  /** Fetches each structure; one that fails is reported and left out. `query` is the page's own (it may hold a token). */
  async load(structures, query, report) {
    this.clear();
    await Promise.all(structures.map((structure) => this.add(structure, query).catch((error) => {
      report(`The mesh of ${structure.name} could not be shown: ${error.message}.`);
    })));
    this.parts.sort((a, b) => b.look.order - a.look.order);
  }

  async add(structure, query) {
    const answer = await fetch(structure.url.replace(/^\//, "") + query);
    if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
    const data = readStl(await answer.arrayBuffer());
    const look = lookOf(structure.role);
    const mesh = new Mesh(geometry(data), glass(look));
    mesh.renderOrder = look.order;
    this.parts.push({ ...structure, look, mesh, data, slicer: new Slicer(data) });
    this.group.add(mesh);
    if (this.isCoarse) this.thin(this.parts.at(-1));
  }

  /** From now on drawn with fewer triangles; sections are cut from the whole meshes as before. */
  coarsen() {
    this.isCoarse = true;
    for (const part of this.parts) this.thin(part);
  }

  thin({ mesh, data, look }) {
    mesh.geometry.dispose();
    mesh.geometry = geometry(coarser(data, look.cell ?? 1.2));
  }

  /** Colours that stand out from a dark or a light ground. */
  dress(theme) {
    for (const part of this.parts) part.mesh.material.uniforms.colour.value.set(inkOf(part.look, theme));
  }

  clear() {
    for (const part of this.parts) {
      part.mesh.geometry.dispose();
      part.mesh.material.dispose();
    }
    this.group.clear();
    this.parts = [];
  }

  show(role, isShown) {
    for (const part of this.parts) if (part.role === role) part.mesh.visible = isShown;
  }

  get roles() {
    return [...new Set(this.parts.map((part) => part.role))];
  }
}

function geometry({ positions, faces }) {
  const shape = new BufferGeometry();
  shape.setAttribute("position", new BufferAttribute(positions, 3));
  shape.setIndex(new BufferAttribute(faces, 1));
  shape.computeVertexNormals();
  return shape;
}
