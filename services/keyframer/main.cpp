// The keyframer's process. Its channels: KeyframerChannels in adapter.hpp, and --help.
#include "services/keyframer/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::keyframer::keyframer_service(), argc, argv);
}
