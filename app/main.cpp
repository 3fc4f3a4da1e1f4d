#include <cstdlib>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "app/command_line.h"

namespace {

// Pictures and their pyramids come and go with each frame: their memory is kept, for to get it anew
// from the system costs more than to calculate with it.
void keepMemory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  keepMemory();
  return diorama::runCommandLine(argc, argv);
}
