using System;
using System.Reflection;
using Upt;
using Upt.Interop;
using Upt.Samples;
using UnityEngine;

/// <summary>Documentation~/index.md, steps 2 and 3, on the stub of the engine: a model asset as the menu makes it, the bundle in StreamingAssets, the
/// sample on an empty object, play. FirstPage STREAMING_ASSETS; prints the greatest force on the spatula.</summary>
internal static class FirstPage
{
    private static int Main(string[] words)
    {
        Application.streamingAssetsPath = words[0];
        GameObject empty = new GameObject("empty");
        empty.SetActive(false);
        PushedBrain sample = empty.AddComponent<PushedBrain>();
        sample.model = ScriptableObject.CreateInstance<UptModel>();
        empty.SetActive(true);
        double most = 0;
        for (int frame = 0; frame < 90 && Debug.Errors.Count == 0; frame++)
        {
            empty.Send("Update");
            sample.Tissue.gameObject.Send("Update");
            Wait(sample.Tissue);
            InstrumentReading reading;
            if (sample.Tissue.TryGetReading(sample.Tissue.instruments[0], out reading)) most = Math.Max(most, reading.force.magnitude);
        }
        foreach (string error in Debug.Errors) Console.WriteLine(error);
        Console.WriteLine("greatest force " + most.ToString("F0", System.Globalization.CultureInfo.InvariantCulture) + " mN");
        empty.SetActive(false);
        return Debug.Errors.Count == 0 && most > 10 ? 0 : 1;
    }

    /// <summary>Until the step in flight has finished: frames here take no time.</summary>
    private static void Wait(SoftTissue tissue)
    {
        const BindingFlags Own = BindingFlags.Instance | BindingFlags.NonPublic;
        bool inFlight = (bool)typeof(SoftTissue).GetField("inFlight", Own).GetValue(tissue);
        Scene scene = (Scene)typeof(SoftTissue).GetField("scene", Own).GetValue(tissue);
        if (inFlight) scene.Wait(uint.MaxValue);
    }
}
