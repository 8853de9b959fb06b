#include <cstdio>
#include <upt.hpp>

int main() {
  try {
    upt::Model::open("no/such/bundle");
  } catch (const upt::error &error) {
    std::printf("%s\n", error.what());
    return upt::abi_matches() && error.status() == UPT_ERR_IO ? 0 : 1;
  }
  return 1;
}
