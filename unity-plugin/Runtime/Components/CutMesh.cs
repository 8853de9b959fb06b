using System;
using System.Collections.Generic;
using Upt.Interop;
using Unity.Collections;
using Unity.Collections.LowLevel.Unsafe;
using UnityEngine;
using UnityEngine.Rendering;

namespace Upt
{
    /// <summary>
    /// The rendered surface of a body that is cut: submesh 0 is what was the surface, submesh 1 what was inside. Positions have a vertex stream of
    /// their own, which a frame uploads; the place at rest is the texture coordinate, three numbers, so that a texture in three dimensions goes on
    /// through new faces. Only a change of the body allocates managed memory.
    /// </summary>
    internal sealed unsafe class CutMesh : IDisposable
    {
        private const MeshUpdateFlags Quiet = MeshUpdateFlags.DontValidateIndices |
                                              MeshUpdateFlags.DontNotifyMeshUsers |
                                              MeshUpdateFlags.DontRecalculateBounds;

        /// <summary>How far a vertex may go from rest before the camera may cull it wrongly, mm.</summary>
        private const float Reach = 50f;

        private readonly CutSurface surface = new CutSurface();
        private readonly List<int> outer = new List<int>();
        private readonly List<int> inner = new List<int>();
        private readonly float scale;
        private NativeArray<Vector3> rest;
        private NativeArray<Vector3> shown;
        private NativeArray<float> displacement;

        /// <summary>The mesh to show.</summary>
        public Mesh Mesh { get; private set; }

        public CutMesh(float unitsPerMillimetre)
        {
            scale = unitsPerMillimetre;
            Mesh = new Mesh();
            Mesh.name = "libupt cut tissue";
            Mesh.MarkDynamic();
        }

        /// <summary>Brings the mesh up to date with the body; where that has not changed, it does nothing.</summary>
        public void Follow(Scene scene)
        {
            int before = surface.Rest.Length;
            // What this mesh has not shown yet is not news to the scene.
            bool first = before == 0;
            if (!scene.UpdateSurface(surface) && !first) return;
            bool grows = surface.IsNew || surface.Rest.Length != before;
            if (grows) TakeVertices();
            outer.Clear();
            inner.Clear();
            for (int slot = 0; slot < surface.Inside.Length; slot++)
            {
                int a = (int)surface.Triangles[3 * slot], b = (int)surface.Triangles[3 * slot + 1];
                if (a == b) continue;
                List<int> list = surface.Inside[slot] != 0 ? inner : outer;
                // The axes change handedness: reverse the winding.
                list.Add(a);
                list.Add((int)surface.Triangles[3 * slot + 2]);
                list.Add(b);
            }
            Mesh.subMeshCount = 2;
            Mesh.SetTriangles(outer, 0, false);
            Mesh.SetTriangles(inner, 1, false);
            if (!grows) return;
            Mesh.RecalculateBounds();
            Bounds bounds = Mesh.bounds;
            bounds.Expand(2f * Reach * scale);
            Mesh.bounds = bounds;
        }

        /// <summary>Takes the tissue <paramref name="seconds"/> after the last published step. No managed memory is
        /// allocated.</summary>
        public void Present(Scene scene, double seconds, StepInput input)
        {
            scene.Present(input, seconds, Native.UPT_VIEW_SURFACE,
                          (float*)NativeArrayUnsafeUtility.GetUnsafePtr(displacement), displacement.Length);
        }

        /// <summary>Uploads the vertices. No managed memory is allocated.</summary>
        public void Upload(bool normals)
        {
            Anatomical.Displace((Vector3*)NativeArrayUnsafeUtility.GetUnsafePtr(rest),
                                (float*)NativeArrayUnsafeUtility.GetUnsafePtr(displacement),
                                (byte*)NativeArrayUnsafeUtility.GetUnsafePtr(shown), sizeof(Vector3), rest.Length, scale);
            Mesh.SetVertexBufferData(shown, 0, 0, shown.Length, 0, Quiet);
            if (normals) Mesh.RecalculateNormals();
        }

        public void Dispose()
        {
            Free();
            if (Mesh != null) UnityEngine.Object.Destroy(Mesh);
            Mesh = null;
        }

        private void TakeVertices()
        {
            Free();
            Vector3[] places = new Vector3[surface.Rest.Length / 3];
            for (int i = 0; i < places.Length; i++)
                places[i] = Anatomical.ToUnity(surface.Rest[3 * i], surface.Rest[3 * i + 1], surface.Rest[3 * i + 2], scale);
            rest = new NativeArray<Vector3>(places, Allocator.Persistent);
            shown = new NativeArray<Vector3>(places, Allocator.Persistent);
            displacement = new NativeArray<float>(new float[surface.Rest.Length], Allocator.Persistent);
            Mesh.Clear();
            Mesh.indexFormat = places.Length > 65535 ? IndexFormat.UInt32 : IndexFormat.UInt16;
            Mesh.SetVertexBufferParams(
                places.Length,
                new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
                new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.Float32, 3, 1),
                new VertexAttributeDescriptor(VertexAttribute.TexCoord0, VertexAttributeFormat.Float32, 3, 2));
            Mesh.SetVertexBufferData(rest, 0, 0, rest.Length, 0, Quiet);
            Mesh.SetVertexBufferData(rest, 0, 0, rest.Length, 2, Quiet);
        }

        private void Free()
        {
            if (rest.IsCreated) rest.Dispose();
            if (shown.IsCreated) shown.Dispose();
            if (displacement.IsCreated) displacement.Dispose();
        }
    }
}
