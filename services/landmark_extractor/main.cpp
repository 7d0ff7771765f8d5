// The landmark extractor's process. Its channels: LandmarkExtractorChannels in adapter.hpp, and
// --help.
#include "services/landmark_extractor/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::landmark_extractor::landmark_extractor_service(),
                                      argc, argv);
}
