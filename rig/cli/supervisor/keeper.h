#pragma once
// No orphans: a small process of its own session that outlives its parent by seconds. It holds the read end
// of a pipe whose other end only the parent has; when that closes, however the parent went, it asks every
// adopted child to stop and kills what stays. Children are held by descriptor (pidfd), so a number that was
// used again cannot be hit.

#include <sys/types.h>

namespace imrig {

class Keeper {
 public:
  Keeper();   // forks; call it before threads exist. Throws Error.
  ~Keeper();  // lets it go; children still running are stopped by it
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;

  void adopt(pid_t child);

 private:
  int fd_ = -1;
  pid_t pid_ = -1;
};

}  // namespace imrig
