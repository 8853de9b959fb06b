using System;

namespace Upt.Interop
{
    public sealed unsafe partial class Scene
    {
        /// <summary>Begins to record what the scene is given, for <c>upt replay --verify</c>, with the hash of what <c>Read</c> gives
        /// after every so many steps. Open the model as portable: only then do other processors compute the same bits.</summary>
        public void Record(uint every = 1)
        {
            if (every == 0) throw new ArgumentOutOfRangeException("every", "give 1 or more; EndRecord ends a recording");
            Begin(every);
        }

        /// <summary>Ends the recording; its last lines are there for <see cref="TakeRecord"/>.</summary>
        public void EndRecord()
        {
            Begin(0);
        }

        /// <summary>The lines of the recording that were not taken before, UTF-8; one after the other they make the file. Empty
        /// where there are none. Take them now and then in a long session.</summary>
        public byte[] TakeRecord()
        {
            IntPtr scene = Enter();
            try
            {
                ulong needed;
                Status.Check(Native.upt_scene_take_record(scene, null, 0, &needed));
                while (needed > 0)
                {
                    byte[] lines = new byte[needed];
                    upt_status status;
                    fixed (byte* l = lines) status = Native.upt_scene_take_record(scene, l, (ulong)lines.Length, &needed);
                    // A step in flight may have added a line.
                    if (status == Native.UPT_ERR_ARGUMENT && needed > (ulong)lines.Length) continue;
                    Status.Check(status);
                    Array.Resize(ref lines, checked((int)needed));
                    return lines;
                }
                return new byte[0];
            }
            finally { Leave(); }
        }

        private void Begin(uint every)
        {
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_record(scene, every)); }
            finally { Leave(); }
        }
    }
}
