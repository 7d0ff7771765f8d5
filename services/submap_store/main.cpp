// The store's process. Its channels: StoreChannels in adapter.hpp, and --help.
#include "services/submap_store/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::submap_store::submap_store_service(), argc, argv);
}
