// The filter's process. Its channels: EkfChannels in adapter.hpp, and --help.
#include "services/ekf/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::ekf::ekf_service(), argc, argv);
}
