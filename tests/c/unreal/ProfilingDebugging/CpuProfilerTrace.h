// A stand-in of Unreal's header of this name: keeps what its macros are given.
#pragma once

#include <string>
#include <vector>

inline std::vector<std::string> &Scopes() {
  static std::vector<std::string> All;
  return All;
}

struct FScope {
  explicit FScope(const char *Name) : Name(Name) { Scopes().push_back("+" + this->Name); }
  ~FScope() { Scopes().push_back("-" + Name); }
  std::string Name;
};

#define TRACE_CPUPROFILER_EVENT_SCOPE(Name) FScope Scope_##Name(#Name)
