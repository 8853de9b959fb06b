// A stand-in of Unreal's header of this name: keeps the last value of each counter by the name that
// Unreal Insights shows.
#pragma once

#include <map>
#include <string>

#define TEXT(String) String

inline std::map<std::string, double> &Counters() {
  static std::map<std::string, double> All;
  return All;
}

struct FCounter {
  explicit FCounter(const char *Name) : Name(Name) {}
  std::string Name;
};

#define TRACE_DECLARE_FLOAT_COUNTER(CounterName, DisplayName)                                      \
  static FCounter GTraceCounter_##CounterName(DisplayName)
#define TRACE_DECLARE_INT_COUNTER(CounterName, DisplayName)                                        \
  TRACE_DECLARE_FLOAT_COUNTER(CounterName, DisplayName)
#define TRACE_COUNTER_SET(CounterName, Value)                                                      \
  (Counters()[GTraceCounter_##CounterName.Name] = static_cast<double>(Value))
