using System;
using Upt.Interop;
using Unity.Collections;
using Unity.Collections.LowLevel.Unsafe;
using UnityEngine;
using UnityEngine.Rendering;

namespace Upt
{
    /// <summary>
    /// The rendered surface of a <see cref="SoftTissue"/>: vertices at rest and displaced, in native memory,
    /// and their upload. Positions lie in a vertex stream of their own, so an upload moves 12 bytes a
    /// vertex and nothing else.
    /// </summary>
    internal sealed unsafe class SurfaceMesh : IDisposable
    {
        private const MeshUpdateFlags Quiet =
            MeshUpdateFlags.DontValidateIndices | MeshUpdateFlags.DontNotifyMeshUsers;

        private NativeArray<Vector3> rest;
        private NativeArray<Vector3> vertices;
        private NativeArray<float> displacement;
        private readonly float scale;

        /// <summary>The mesh to show.</summary>
        public Mesh Mesh { get; private set; }

        /// <summary>Number of vertices.</summary>
        public int Count
        {
            get { return rest.Length; }
        }

        /// <summary>Vertices of <paramref name="source"/> (in the tissue's local space), or the bundle's own
        /// surface when it is null.</summary>
        public SurfaceMesh(Model model, Mesh source, float unitsPerMillimetre)
        {
            scale = unitsPerMillimetre;
            Vector3[] points;
            int[] triangles;
            if (source != null)
            {
                points = source.vertices;
                triangles = source.triangles;
            }
            else
            {
                FromBundle(model, unitsPerMillimetre, out points, out triangles);
            }
            rest = new NativeArray<Vector3>(points, Allocator.Persistent);
            vertices = new NativeArray<Vector3>(points, Allocator.Persistent);
            displacement = new NativeArray<float>(3 * points.Length, Allocator.Persistent);
            Mesh = new Mesh();
            Mesh.name = "libupt soft tissue";
            Mesh.MarkDynamic();
            Mesh.SetVertexBufferParams(
                points.Length,
                new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
                new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.Float32, 3, 1));
            Mesh.SetVertexBufferData(vertices, 0, 0, points.Length, 0, Quiet);
            Mesh.indexFormat = points.Length > 65535 ? IndexFormat.UInt32 : IndexFormat.UInt16;
            Mesh.triangles = triangles;
            Mesh.RecalculateNormals();
            Mesh.RecalculateBounds();
        }

        /// <summary>Rest vertices in the bundle's axes, mm, <c>[Count,3]</c>: the points to attach.</summary>
        public float[] PointsInBundle()
        {
            float[] points = new float[3 * Count];
            fixed (float* pointer = points)
            {
                for (int i = 0; i < Count; i++) Anatomical.FromUnity(rest[i], scale, pointer + 3 * i);
            }
            return points;
        }

        /// <summary>Samples <paramref name="scene"/> at <paramref name="alpha"/> and uploads the vertices. No
        /// managed memory is allocated.</summary>
        public void Upload(Scene scene, double alpha, bool normals)
        {
            float* u = (float*)NativeArrayUnsafeUtility.GetUnsafePtr(displacement);
            scene.SamplePoints(alpha, u, displacement.Length);
            Anatomical.Displace((Vector3*)NativeArrayUnsafeUtility.GetUnsafePtr(rest), u,
                                (Vector3*)NativeArrayUnsafeUtility.GetUnsafePtr(vertices), Count, scale);
            Mesh.SetVertexBufferData(vertices, 0, 0, Count, 0, Quiet);
            if (normals) Mesh.RecalculateNormals();
        }

        public void Dispose()
        {
            if (rest.IsCreated) rest.Dispose();
            if (vertices.IsCreated) vertices.Dispose();
            if (displacement.IsCreated) displacement.Dispose();
        }

        private static void FromBundle(Model model, float scale, out Vector3[] points, out int[] triangles)
        {
            float[] positions = model.Positions();
            uint[] faces = model.Indices(Native.UPT_SET_SURFACE_FACES);
            int[] vertexOf = new int[model.NodeCount];
            for (int i = 0; i < vertexOf.Length; i++) vertexOf[i] = -1;
            int count = 0;
            foreach (uint node in faces)
                if (vertexOf[node] < 0) vertexOf[node] = count++;
            points = new Vector3[count];
            for (int node = 0; node < vertexOf.Length; node++)
                if (vertexOf[node] >= 0)
                    points[vertexOf[node]] = Anatomical.ToUnity(positions[3 * node], positions[3 * node + 1],
                                                                positions[3 * node + 2], scale);
            triangles = new int[faces.Length];
            for (int f = 0; f < faces.Length; f += 3)
            {
                // The axes change handedness: reverse the winding.
                triangles[f] = vertexOf[faces[f]];
                triangles[f + 1] = vertexOf[faces[f + 2]];
                triangles[f + 2] = vertexOf[faces[f + 1]];
            }
        }
    }
}
