#include "common/packets/readings.hpp"

namespace understory::packets {

std::string_view to_string(Fault fault) {
  switch (fault) {
    case Fault::kWrongSize:
      return "wrong size";
    case Fault::kOtherModel:
      return "another model or format";
    case Fault::kDamaged:
      return "damaged";
    case Fault::kLate:
      return "late";
  }
  return "";
}

}  // namespace understory::packets
