#pragma once
// Marks of the hidden-effect suite: shares of runs over all cells, each with its target and its interval.

#include <map>
#include <string>

#include "bench/hidden/score.h"
#include "bench/hidden/share.h"

namespace imrig::bench {

class Marks {
 public:
  void count(const Outcome& outcome);
  void print_all(bool json) const;

 private:
  void count_outside(const Outcome& outcome);
  void count_seen(const Outcome& outcome);
  void count_followed(const FollowUp& follow);

  Share spoke_, false_claim_, first_, in_set_, false_of_accepted_, exact_, triples_exact_, excess_, at_floor_,
      at_chance_, nothing_at_floor_, covered_;
  Share blamed_, blamed_surely_, refused_, unknown_, raised_, settled_;
  int references_ = 0;
  double set_sizes_ = 0.0;
  std::map<std::string, int> missed_, false_;
};

}  // namespace imrig::bench
