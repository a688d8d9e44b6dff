// The cell: a client of all other nodes that is a service itself. Layer: example.
#pragma once

#include <string>

#include "finder.hpp"
#include "parts.hpp"

namespace microassembly {

class Cell : public definition::CellService {
 public:
  explicit Cell(Finder& finder);
  /// To be called regularly: says what is there.
  void publish();

 private:
  void move(std::int32_t probe, Pose by) override;
  void illuminate(std::int32_t illuminator, double level) override;
  void focus(std::int32_t camera, double height) override;
  void halt() override;

  rr::ServiceSubscription stages_;
  rr::TypedWireSubscription<Poses> stage_poses_;
  rr::ServiceSubscription cameras_;
  rr::ServiceSubscription illuminators_;
  // As they are wanted; empty: not known yet, or the node has gone.
  Poses targets_;
  Numbers heights_;
  Numbers levels_;
};

}  // namespace microassembly
