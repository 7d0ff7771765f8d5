// The mapper's process. Its channels: MapperChannels in adapter.hpp, and --help.
#include "services/geoslam_mapper/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::geoslam_mapper::geoslam_mapper_service(), argc,
                                      argv);
}
