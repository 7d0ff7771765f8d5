#include "services/submap_store/adapter_parameters.hpp"

namespace understory::submap_store {

void describe(StoreParameters& parameters, bus::ParameterTable& table) {
  FolderParameters& file = parameters.file;
  table.add("file.folder", file.folder, {},
            "Folder of the files, drive-0001.gpkg and so on; relative to the folder in which the "
            "process was started. Empty: the folder maps in the process's state directory.");
  table.add("file.go_on_within_s", file.go_on_within_s, {0.0, 1e9}, "s",
            "A started store continues the last file if that drive's newest message is older by "
            "less (message time). A mapper that starts a new map always starts a new file.");
  table.add("file.seal_within_s", file.seal_within_s, {0.0, 3600.0}, "s",
            "Longest time for completing the file when the store is stopped; the program that "
            "opens the file next does the rest. `understory launch` waits for 0.9 s.");
  table.add("file.rows_sealed_per_s", file.rows_sealed_per_s, {1.0, 1e9}, "1/s",
            "Landmarks and keyframes that this computer completes in a second.");

  WritingParameters& writing = parameters.writing;
  table.add("writing.ground_period_s", writing.ground_period_s, {0.1, 3600.0}, "s",
            "Period (message time) at which the mapper's own part of the map, around the vehicle, "
            "is written. A power failure loses this much of it.");
  table.add("writing.moved_landmarks_per_s", writing.moved_landmarks_per_s, {1, 1000000}, "1/s",
            "Most moved landmarks of that part that are rewritten per second of message time, in "
            "turn. New ones are written at once; after a jump of the whole map, MAP comes and all "
            "are rewritten.");
  table.add("writing.submaps_per_s", writing.submaps_per_s, {1, 10000}, "1/s",
            "Submaps whose landmarks are rewritten per second of message time after a correction "
            "has moved them.");

  StoreInputParameters& input = parameters.input;
  table.add("input.max_landmarks", input.max_landmarks, {1, 1000000}, "",
            "SUBMAP with more landmarks is refused and counted (too_large): this bounds the cost "
            "of a message. The mapper hands over 2000 at most.");
  table.add("input.max_map_landmarks", input.max_map_landmarks, {1, 10000000}, "",
            "The same for MAP and MAP_DELTA.");
}

}  // namespace understory::submap_store
