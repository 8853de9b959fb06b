using Unity.Profiling;
using Upt.Interop;

namespace Upt
{
    /// <summary>
    /// Stage times of the steps that finished in a frame, over all tissues, as counters of Unity's profiler
    /// (category Scripts). The steps run on libupt's workers: this is their time, not the frame's.
    /// </summary>
    internal static class StepCounters
    {
        // Not readonly: their values are set.
        private static ProfilerCounterValue<long> step = Counter("libupt Step");
        private static ProfilerCounterValue<long> prior = Counter("libupt Prior");
        private static ProfilerCounterValue<long> encode = Counter("libupt Encode");
        private static ProfilerCounterValue<long> aggregate = Counter("libupt Aggregate");
        private static ProfilerCounterValue<long> latent = Counter("libupt Latent");
        private static ProfilerCounterValue<long> decode = Counter("libupt Decode");
        private static ProfilerCounterValue<long> corrections = Counter("libupt Corrections");
        private static ProfilerCounterValue<long> guard = Counter("libupt Guard");

        /// <summary>Adds a finished step. Allocates nothing.</summary>
        public static void Add(upt_scene_timing timing)
        {
            step.Value += Nanoseconds(timing.step_ms);
            prior.Value += Nanoseconds(timing.prior_ms);
            encode.Value += Nanoseconds(timing.encode_ms);
            aggregate.Value += Nanoseconds(timing.aggregate_ms);
            latent.Value += Nanoseconds(timing.latent_ms);
            decode.Value += Nanoseconds(timing.decode_ms);
            corrections.Value += Nanoseconds(timing.corrections_ms);
            guard.Value += Nanoseconds(timing.guard_ms);
        }

        private static ProfilerCounterValue<long> Counter(string name)
        {
            return new ProfilerCounterValue<long>(
                ProfilerCategory.Scripts, name, ProfilerMarkerDataUnit.TimeNanoseconds,
                ProfilerCounterOptions.FlushOnEndOfFrame | ProfilerCounterOptions.ResetToZeroOnFlush);
        }

        private static long Nanoseconds(double milliseconds)
        {
            return (long)(milliseconds * 1e6);
        }
    }
}
