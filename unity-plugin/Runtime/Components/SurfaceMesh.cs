using System;
using Upt.Interop;
using Unity.Collections;
using Unity.Collections.LowLevel.Unsafe;
using UnityEngine;
using UnityEngine.Rendering;

namespace Upt
{
    /// <summary>
    /// The rendered surface of a <see cref="SoftTissue"/>: a mesh of its own, the vertices at rest, and the
    /// vertex stream that holds their positions in native memory. An upload writes that stream and
    /// nothing else: 12 bytes a vertex for the bundle's surface; the source's own layout for a mesh of the host's,
    /// whose texture coordinates, colours and submeshes stay as they are.
    /// </summary>
    internal sealed unsafe class SurfaceMesh : IDisposable
    {
        private const MeshUpdateFlags Quiet = MeshUpdateFlags.DontValidateIndices |
                                              MeshUpdateFlags.DontNotifyMeshUsers |
                                              MeshUpdateFlags.DontRecalculateBounds;

        /// <summary>How far a vertex may go from rest before the camera may cull it wrongly, mm: more than any
        /// bundle's bound on displacements.</summary>
        private const float Reach = 50f;

        private NativeArray<Vector3> rest;
        private NativeArray<byte> stream;
        private NativeArray<float> displacement;
        private readonly int streamIndex;
        private readonly int stride;
        private readonly int offset;
        private readonly float scale;

        /// <summary>The mesh to show.</summary>
        public Mesh Mesh { get; private set; }

        /// <summary>Number of vertices.</summary>
        public int Count
        {
            get { return rest.Length; }
        }

        /// <summary>A copy of <paramref name="source"/> (in the tissue's local space), or the bundle's own surface
        /// when it is null. Throws <see cref="InvalidOperationException"/> for a mesh that scripts cannot read
        /// or whose positions are compressed.</summary>
        public SurfaceMesh(Model model, Mesh source, float unitsPerMillimetre)
        {
            scale = unitsPerMillimetre;
            Mesh = source != null ? Copy(source) : FromBundle(model, unitsPerMillimetre);
            Mesh.name = "libupt soft tissue";
            Mesh.MarkDynamic();
            streamIndex = Mesh.GetVertexAttributeStream(VertexAttribute.Position);
            offset = Mesh.GetVertexAttributeOffset(VertexAttribute.Position);
            using (Mesh.MeshDataArray data = Mesh.AcquireReadOnlyMeshData(Mesh))
                stream = new NativeArray<byte>(data[0].GetVertexData<byte>(streamIndex).ToArray(), Allocator.Persistent);
            stride = stream.Length / Mesh.vertexCount;
            rest = new NativeArray<Vector3>(Mesh.vertices, Allocator.Persistent);
            displacement = new NativeArray<float>(3 * rest.Length, Allocator.Persistent);
            Bounds bounds = Mesh.bounds;
            bounds.Expand(2f * Reach * unitsPerMillimetre);
            Mesh.bounds = bounds;
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

        /// <summary>Samples <paramref name="scene"/> at <paramref name="alpha"/>. No managed memory is
        /// allocated.</summary>
        public void Sample(Scene scene, double alpha)
        {
            scene.Sample(alpha, Native.UPT_VIEW_POINTS, (float*)NativeArrayUnsafeUtility.GetUnsafePtr(displacement), displacement.Length);
        }

        /// <summary>Whether a scene at rest can show the present moment.</summary>
        public bool TryPresent(Scene scene)
        {
            try
            {
                Present(scene, 0.0, default(StepInput));
            }
            catch (UptException error)
            {
                if (error.Status != Native.UPT_ERR_UNSUPPORTED) throw;
                return false;
            }
            return true;
        }

        /// <summary>Takes the tissue <paramref name="seconds"/> after the last published step, with the instruments and supports
        /// where they are then. No managed memory is allocated.</summary>
        public void Present(Scene scene, double seconds, StepInput input)
        {
            scene.Present(input, seconds, Native.UPT_VIEW_POINTS,
                          (float*)NativeArrayUnsafeUtility.GetUnsafePtr(displacement), displacement.Length);
        }

        /// <summary>Uploads the sampled vertices. No managed memory is allocated.</summary>
        public void Upload(bool normals)
        {
            Anatomical.Displace((Vector3*)NativeArrayUnsafeUtility.GetUnsafePtr(rest),
                                (float*)NativeArrayUnsafeUtility.GetUnsafePtr(displacement),
                                (byte*)NativeArrayUnsafeUtility.GetUnsafePtr(stream) + offset, stride, Count, scale);
            Mesh.SetVertexBufferData(stream, 0, 0, stream.Length, streamIndex, Quiet);
            if (normals) Mesh.RecalculateNormals();
        }

        public void Dispose()
        {
            if (rest.IsCreated) rest.Dispose();
            if (stream.IsCreated) stream.Dispose();
            if (displacement.IsCreated) displacement.Dispose();
            if (Mesh != null) UnityEngine.Object.Destroy(Mesh);
            Mesh = null;
        }

        private static Mesh Copy(Mesh source)
        {
            if (source.vertexCount == 0)
                throw new InvalidOperationException("mesh '" + source.name + "' has no vertices");
            if (!source.isReadable)
                throw new InvalidOperationException("mesh '" + source.name +
                                                    "' is not readable: turn on Read/Write in its import settings");
            if (source.GetVertexAttributeFormat(VertexAttribute.Position) != VertexAttributeFormat.Float32)
                throw new InvalidOperationException(
                    "mesh '" + source.name +
                    "' has compressed positions: turn off Position in Player Settings > Vertex Compression");
            return UnityEngine.Object.Instantiate(source);
        }

        private static Mesh FromBundle(Model model, float scale)
        {
            float[] positions = model.Positions();
            uint[] faces = model.Indices(Native.UPT_SET_SURFACE_FACES);
            int[] vertexOf = new int[model.NodeCount];
            for (int i = 0; i < vertexOf.Length; i++) vertexOf[i] = -1;
            int count = 0;
            foreach (uint node in faces)
                if (vertexOf[node] < 0) vertexOf[node] = count++;
            Vector3[] points = new Vector3[count];
            for (int node = 0; node < vertexOf.Length; node++)
                if (vertexOf[node] >= 0)
                    points[vertexOf[node]] = Anatomical.ToUnity(positions[3 * node], positions[3 * node + 1],
                                                                positions[3 * node + 2], scale);
            int[] triangles = new int[faces.Length];
            for (int f = 0; f < faces.Length; f += 3)
            {
                // The axes change handedness: reverse the winding.
                triangles[f] = vertexOf[faces[f]];
                triangles[f + 1] = vertexOf[faces[f + 2]];
                triangles[f + 2] = vertexOf[faces[f + 1]];
            }
            Mesh mesh = new Mesh();
            mesh.SetVertexBufferParams(
                count, new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
                new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.Float32, 3, 1));
            mesh.vertices = points;
            mesh.indexFormat = count > 65535 ? IndexFormat.UInt32 : IndexFormat.UInt16;
            mesh.triangles = triangles;
            mesh.RecalculateNormals();
            mesh.RecalculateBounds();
            return mesh;
        }
    }
}
