// The loop closer's process. Its channels: LoopCloserChannels in adapter.hpp, and --help.
#include "services/loop_closer/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::loop_closer::loop_closer_service(), argc, argv);
}
