// A STUB of the UnityEngine types that the package uses, so that the components compile and run their
// logic without Unity. It is not Unity: no rendering, no serialisation; transforms are rigid with a
// uniform scale. Signatures follow Unity 2021.3.
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;

namespace UnityEngine
{
    [StructLayout(LayoutKind.Sequential)]
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 zero { get { return new Vector3(0, 0, 0); } }
        public static Vector3 up { get { return new Vector3(0, 1, 0); } }
        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
        public static Vector3 operator -(Vector3 a) { return new Vector3(-a.x, -a.y, -a.z); }
        public static Vector3 operator *(Vector3 a, float s) { return new Vector3(a.x * s, a.y * s, a.z * s); }
        public float magnitude { get { return (float)Math.Sqrt(x * x + y * y + z * z); } }
        public Vector3 normalized { get { float m = magnitude; return m > 0 ? this * (1f / m) : zero; } }
        public static float Dot(Vector3 a, Vector3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
        public static Vector3 Cross(Vector3 a, Vector3 b)
        {
            return new Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
        }
    }

    public struct Quaternion
    {
        public float x, y, z, w;
        public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static Quaternion identity { get { return new Quaternion(0, 0, 0, 1); } }
        public static Quaternion Inverse(Quaternion q) { return new Quaternion(-q.x, -q.y, -q.z, q.w); }
        public static Quaternion operator *(Quaternion a, Quaternion b)
        {
            return new Quaternion(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                                  a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                                  a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                                  a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }
        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            Vector3 u = new Vector3(q.x, q.y, q.z);
            Vector3 t = Vector3.Cross(u, v) * 2f;
            return v + t * q.w + Vector3.Cross(u, t);
        }
        public static Quaternion AngleAxis(float degrees, Vector3 axis)
        {
            double half = degrees * Math.PI / 360.0;
            Vector3 n = axis.normalized * (float)Math.Sin(half);
            return new Quaternion(n.x, n.y, n.z, (float)Math.Cos(half));
        }
        public static Quaternion LookRotation(Vector3 forward, Vector3 up)
        {
            Vector3 f = forward.normalized;
            Vector3 axis = Vector3.Cross(new Vector3(0, 0, 1), f);
            float c = f.z;
            if (axis.magnitude < 1e-6f) return c > 0 ? identity : AngleAxis(180f, up);
            return AngleAxis((float)(Math.Acos(Math.Max(-1f, Math.Min(1f, c))) * 180.0 / Math.PI), axis);
        }
    }

    public struct Matrix4x4
    {
        public float determinant;
        public static Matrix4x4 TRS(Vector3 position, Quaternion rotation, Vector3 scale) { return default(Matrix4x4); }
    }

    public struct Bounds
    {
        public Vector3 size;
        public void Expand(float amount) { size = size + new Vector3(amount, amount, amount); }
    }

    public struct Color
    {
        public float r, g, b, a;
        public Color(float r, float g, float b) { this.r = r; this.g = g; this.b = b; a = 1f; }
        public static Color cyan { get { return new Color(0, 1, 1); } }
        public static Color green { get { return new Color(0, 1, 0); } }
        public static Color red { get { return new Color(1, 0, 0); } }
        public static Color yellow { get { return new Color(1, 1, 0); } }
    }

    public class Object
    {
        public string name = string.Empty;
        public bool destroyed;
        public static void Destroy(Object target)
        {
            target.destroyed = true;
            GameObject item = target as GameObject;
            if (item != null) item.SetActive(false);
        }
        public static T Instantiate<T>(T original) where T : Object
        {
            T copy = (T)original.MemberwiseClone();
            copy.Separate();
            return copy;
        }
        /// <summary>After a member-wise copy: arrays of its own.</summary>
        protected virtual void Separate() { }
    }

    public class ScriptableObject : Object
    {
        public static T CreateInstance<T>() where T : ScriptableObject, new() { return new T(); }
    }

    public class Component : Object
    {
        public GameObject gameObject;
        public Transform transform { get { return gameObject.transform; } }
        public T GetComponent<T>() where T : Component { return gameObject.GetComponent<T>(); }
    }

    public class Behaviour : Component
    {
        public bool enabled = true;
        public bool isActiveAndEnabled { get { return enabled && gameObject.activeSelf; } }
    }

    public class MonoBehaviour : Behaviour { }

    public class Transform : Component
    {
        public Vector3 position;
        public Quaternion rotation = Quaternion.identity;
        public Vector3 localScale;
        public void SetParent(Transform parent, bool worldPositionStays) { }
        public Matrix4x4 localToWorldMatrix
        {
            get { return new Matrix4x4 { determinant = localScale.x * localScale.y * localScale.z }; }
        }
        public Vector3 InverseTransformPoint(Vector3 world) { return Quaternion.Inverse(rotation) * (world - position); }
        public Vector3 TransformPoint(Vector3 local) { return position + rotation * local; }
    }

    public class GameObject : Object
    {
        private readonly List<Component> components = new List<Component>();
        public readonly Transform transform;
        public bool activeSelf { get; private set; }
        public GameObject(string name)
        {
            this.name = name;
            activeSelf = true;
            transform = new Transform();
            transform.gameObject = this;
        }
        public T AddComponent<T>() where T : Component, new()
        {
            T component = new T();
            component.gameObject = this;
            component.name = name;
            components.Add(component);
            if (activeSelf) Send(component, "OnEnable");
            return component;
        }
        public static GameObject CreatePrimitive(PrimitiveType type)
        {
            GameObject item = new GameObject("Cube");
            item.AddComponent<MeshFilter>();
            item.AddComponent<MeshRenderer>();
            return item;
        }
        public T GetComponent<T>() where T : Component
        {
            foreach (Component component in components)
            {
                T found = component as T;
                if (found != null) return found;
            }
            return null;
        }
        /// <summary>Calls OnEnable or OnDisable of the behaviours, as the engine does.</summary>
        public void SetActive(bool active)
        {
            if (active == activeSelf) return;
            activeSelf = active;
            Send(active ? "OnEnable" : "OnDisable");
        }
        /// <summary>Calls a message method of every behaviour, as the engine's loop does.</summary>
        public void Send(string message)
        {
            foreach (Component component in components) Send(component, message);
        }
        private static void Send(Component component, string message)
        {
            System.Reflection.MethodInfo method = component.GetType().GetMethod(
                message, System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic |
                             System.Reflection.BindingFlags.Public);
            if (method != null) method.Invoke(component, null);
        }
    }

    public class MeshCollider : Component { public Mesh sharedMesh; }
    public class MeshFilter : Component { public Mesh sharedMesh; }
    public class MeshRenderer : Component
    {
        public Material[] sharedMaterials = new Material[1];
        public Material sharedMaterial { get { return sharedMaterials[0]; } set { sharedMaterials[0] = value; } }
    }
    public class Shader : Object { public static Shader Find(string name) { return new Shader(); } }
    public class Material : Object { public Color color; public Material(Shader shader) { } }
    public class Camera : Component
    {
        public static Camera main;
        public float nearClipPlane;
    }
    public static class Input
    {
        public static bool GetMouseButton(int button) { return false; }
    }
    public enum PrimitiveType { Cube, Sphere }

    public static class Time { public static float deltaTime = 1f / 60f; }
    public static class Application
    {
        public static string streamingAssetsPath = ".";
        public static bool isPlaying = true;
    }
    public static class Debug
    {
        public static readonly List<string> Errors = new List<string>();
        public static void Log(object message) { }
        public static readonly List<string> Warnings = new List<string>();
        public static void LogWarning(object message, Object context) { Warnings.Add(message.ToString()); }
        public static void LogError(object message, Object context) { Errors.Add(message.ToString()); }
    }
    public static class Gizmos
    {
        public static Matrix4x4 matrix;
        public static Color color;
        public static void DrawWireSphere(Vector3 center, float radius) { }
        public static void DrawWireCube(Vector3 center, Vector3 size) { }
        public static void DrawLine(Vector3 from, Vector3 to) { }
    }

    public sealed class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }
    public sealed class RangeAttribute : Attribute { public RangeAttribute(float min, float max) { } }
    public sealed class MinAttribute : Attribute { public MinAttribute(float min) { } }
    public sealed class RequireComponent : Attribute { public RequireComponent(Type type) { } }
    public sealed class CreateAssetMenuAttribute : Attribute { public string fileName, menuName; }
}

namespace Unity.Profiling
{
    public struct ProfilerCategory { public static ProfilerCategory Scripts { get { return default(ProfilerCategory); } } }
    public enum ProfilerMarkerDataUnit { TimeNanoseconds = 1 }
    [Flags]
    public enum ProfilerCounterOptions { None = 0, FlushOnEndOfFrame = 2, ResetToZeroOnFlush = 4 }

    /// <summary>The counters made so far, by name; the stub never flushes them.</summary>
    public static class StubCounters
    {
        public static readonly Dictionary<string, object> Cells = new Dictionary<string, object>();
        public static long Read(string name) { return ((ProfilerCounterValue<long>.Cell)Cells[name]).Value; }
    }

    public struct ProfilerCounterValue<T> where T : struct
    {
        public sealed class Cell { public T Value; }
        private readonly Cell cell;
        public ProfilerCounterValue(ProfilerCategory category, string name, ProfilerMarkerDataUnit unit,
                                    ProfilerCounterOptions options)
        {
            cell = new Cell();
            StubCounters.Cells[name] = cell;
        }
        public T Value { get { return cell.Value; } set { cell.Value = value; } }
    }

    public struct ProfilerMarker
    {
        public ProfilerMarker(string name) { }
        public AutoScope Auto() { return default(AutoScope); }
        public struct AutoScope : IDisposable { public void Dispose() { } }
    }
}

namespace UnityEditor
{
    public sealed class CustomEditor : Attribute { public CustomEditor(Type type) { } }
    public sealed class DrawGizmo : Attribute { public DrawGizmo(GizmoType kind) { } }
    [Flags]
    public enum GizmoType { Selected = 4 }
    public enum MessageType { Warning = 2 }
    public class Editor
    {
        public UnityEngine.Object target;
        public virtual void OnInspectorGUI() { }
        public virtual bool RequiresConstantRepaint() { return false; }
        public void DrawDefaultInspector() { }
        public void Repaint() { }
    }
    public static class EditorGUILayout
    {
        public static void LabelField(string label, string text) { }
        public static void HelpBox(string text, MessageType type) { }
    }
}
