// A STUB of Unity's meshes and native arrays; see UnityEngineStub.cs.
using System;
using System.Runtime.InteropServices;

namespace UnityEngine
{
    /// <summary>Vertices in one interleaved stream (position, normal, a texture coordinate: 32 bytes), as an imported mesh has
    /// them, until SetVertexBufferParams gives positions a stream of their own.</summary>
    public class Mesh : Object
    {
        public const int Interleaved = 32;
        private Vector3[] points = new Vector3[0];
        public int[] triangles = new int[0];
        public Rendering.IndexFormat indexFormat;
        public Bounds bounds;
        public bool isReadable = true;
        public int stride = Interleaved;
        /// <summary>The stream that holds the positions.</summary>
        public byte[] stream = new byte[0];
        public int vertexCount { get { return points.Length; } }
        public Vector3[] vertices
        {
            get { return (Vector3[])points.Clone(); }
            set
            {
                points = (Vector3[])value.Clone();
                stream = new byte[stride * points.Length];
                for (int i = 0; i < stream.Length; i++) stream[i] = (byte)i;
                for (int i = 0; i < points.Length; i++)
                    Buffer.BlockCopy(new[] { points[i].x, points[i].y, points[i].z }, 0, stream, stride * i, 12);
            }
        }
        protected override void Separate() { stream = (byte[])stream.Clone(); }
        /// <summary>What the graphics card would show.</summary>
        public Vector3 Shown(int vertex)
        {
            float[] p = new float[3];
            Buffer.BlockCopy(stream, stride * vertex, p, 0, 12);
            return new Vector3(p[0], p[1], p[2]);
        }
        public void MarkDynamic() { }
        public void RecalculateNormals() { }
        /// <summary>Triangles of each submesh.</summary>
        private readonly System.Collections.Generic.List<int[]> parts = new System.Collections.Generic.List<int[]>();
        public int subMeshCount
        {
            get { return parts.Count; }
            set
            {
                while (parts.Count > value) parts.RemoveAt(parts.Count - 1);
                while (parts.Count < value) parts.Add(new int[0]);
            }
        }
        public void SetTriangles(System.Collections.Generic.List<int> corners, int submesh, bool calculateBounds)
        {
            foreach (int corner in corners)
                if (corner < 0 || corner >= vertexCount) throw new ArgumentOutOfRangeException("corners");
            parts[submesh] = corners.ToArray();
        }
        public int[] GetTriangles(int submesh) { return parts[submesh]; }
        public void Clear()
        {
            vertices = new Vector3[0];
            parts.Clear();
        }
        public void RecalculateBounds() { }
        public int GetVertexAttributeStream(Rendering.VertexAttribute attribute) { return 0; }
        public int GetVertexAttributeOffset(Rendering.VertexAttribute attribute) { return 0; }
        public Rendering.VertexAttributeFormat GetVertexAttributeFormat(Rendering.VertexAttribute attribute)
        {
            return Rendering.VertexAttributeFormat.Float32;
        }
        public void SetVertexBufferParams(int count, params Rendering.VertexAttributeDescriptor[] layout)
        {
            stride = 12;
            if (points.Length != count) vertices = new Vector3[count];
        }
        public void SetVertexBufferData<T>(Unity.Collections.NativeArray<T> data, int dataStart, int meshStart, int count,
                                           int streamIndex, Rendering.MeshUpdateFlags flags) where T : struct
        {
            if (Marshal.SizeOf(typeof(T)) * count != stream.Length) throw new ArgumentException("not the stream's size");
            if (streamIndex != 0) return;
            Marshal.Copy(data.pointer, stream, 0, stream.Length);
        }
        public static MeshDataArray AcquireReadOnlyMeshData(Mesh mesh) { return new MeshDataArray(mesh); }
        public struct MeshDataArray : IDisposable
        {
            private readonly Mesh mesh;
            public MeshDataArray(Mesh mesh) { this.mesh = mesh; }
            public MeshData this[int index] { get { return new MeshData(mesh); } }
            public void Dispose() { }
        }
        public struct MeshData
        {
            private readonly Mesh mesh;
            public MeshData(Mesh mesh) { this.mesh = mesh; }
            public Unity.Collections.NativeArray<T> GetVertexData<T>(int stream) where T : struct
            {
                return new Unity.Collections.NativeArray<T>((T[])(object)mesh.stream, Unity.Collections.Allocator.Persistent);
            }
        }
    }
}

namespace UnityEngine.Rendering
{
    public enum IndexFormat { UInt16, UInt32 }
    public enum VertexAttribute { Position, Normal, TexCoord0 }
    public enum VertexAttributeFormat { Float32 }
    [Flags]
    public enum MeshUpdateFlags { Default = 0, DontValidateIndices = 1, DontNotifyMeshUsers = 4, DontRecalculateBounds = 8 }
    public class RenderPipelineAsset : Object { public Shader defaultShader { get { return new Shader(); } } }
    public static class GraphicsSettings { public static RenderPipelineAsset currentRenderPipeline; }
    public struct VertexAttributeDescriptor
    {
        public VertexAttributeDescriptor(VertexAttribute attribute, VertexAttributeFormat format, int dimension, int stream)
        {
        }
    }
}

namespace Unity.Collections
{
    public enum Allocator { Persistent }
    public unsafe struct NativeArray<T> : IDisposable where T : struct
    {
        internal IntPtr pointer;
        private int length;
        public NativeArray(int length, Allocator allocator)
        {
            this.length = length;
            pointer = Marshal.AllocHGlobal(Math.Max(1, length * Marshal.SizeOf(typeof(T))));
        }
        public NativeArray(T[] source, Allocator allocator) : this(source.Length, allocator)
        {
            int size = Marshal.SizeOf(typeof(T));
            for (int i = 0; i < source.Length; i++)
                Marshal.StructureToPtr(source[i], (IntPtr)((long)pointer + (long)i * size), false);
        }
        public int Length { get { return length; } }
        public T[] ToArray()
        {
            T[] copy = new T[length];
            for (int i = 0; i < length; i++) copy[i] = this[i];
            return copy;
        }
        public bool IsCreated { get { return pointer != IntPtr.Zero; } }
        public T this[int index]
        {
            get
            {
                return (T)Marshal.PtrToStructure(
                    (IntPtr)((long)pointer + (long)index * Marshal.SizeOf(typeof(T))), typeof(T));
            }
        }
        public void Dispose()
        {
            Marshal.FreeHGlobal(pointer);
            pointer = IntPtr.Zero;
        }
    }
}

namespace Unity.Collections.LowLevel.Unsafe
{
    public static unsafe class NativeArrayUnsafeUtility
    {
        public static void* GetUnsafePtr<T>(NativeArray<T> array) where T : struct { return (void*)array.pointer; }
    }
}
