using System;
using System.IO;
using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// A bundle as an asset: one native model, opened on first use and shared by every
    /// <see cref="SoftTissue"/> that refers to it. Create one with Assets &gt; Create &gt; libupt &gt; Model.
    /// </summary>
    [CreateAssetMenu(fileName = "UptModel", menuName = "libupt/Model")]
    public sealed class UptModel : ScriptableObject
    {
        [Tooltip("Bundle folder: absolute, or relative to StreamingAssets.")]
        public string bundlePath = "brain";

        [Tooltip("Threads of a step. 0: the library's default.")]
        public int threads = 0;

        [NonSerialized] private Model model;
        [NonSerialized] private int users;

        /// <summary>The bundle folder as an absolute path.</summary>
        public string ResolvedPath
        {
            get
            {
                return Path.IsPathRooted(bundlePath)
                           ? bundlePath
                           : Path.Combine(Application.streamingAssetsPath, bundlePath);
            }
        }

        /// <summary>Whether the model can be opened. In a WebGL player its files come from the web: the first question fetches them and the library,
        /// and a <see cref="SoftTissue"/> begins once they are here. Throws <see cref="UptException"/> where they are not to be had.</summary>
        public bool IsReady
        {
            get
            {
#if UNITY_WEBGL && !UNITY_EDITOR
                return model != null || WebBundle.IsReady(Application.streamingAssetsPath + "/libupt", ResolvedPath);
#else
                return true;
#endif
            }
        }

        /// <summary>Opens the model if it is not open; each call is paired with
        /// <see cref="Release"/>.</summary>
        public Model Acquire()
        {
            if (model == null)
            {
                string path = ResolvedPath;
#if !UNITY_WEBGL || UNITY_EDITOR
                if (!Directory.Exists(path))
                    throw new DirectoryNotFoundException(
                        "libupt bundle '" + path + "' does not exist: copy a bundle folder (onnx/brain) into " +
                        "StreamingAssets, or set an absolute path on the UptModel asset '" + name + "'");
#endif
                model = new Model(path, (uint)Math.Max(0, threads));
            }
            users++;
            return model;
        }

        /// <summary>Closes the model with its last user.</summary>
        public void Release()
        {
            if (users > 0) users--;
            if (users == 0) Close();
        }

        private void OnDisable()
        {
            // Domain reload and editor quit: scenes keep the native model alive until they are disposed.
            users = 0;
            Close();
        }

        private void Close()
        {
            if (model == null) return;
            model.Dispose();
            model = null;
        }
    }
}
