#include "app/command_line.h"

int main(int argc, char** argv) { return diorama::runCommandLine(argc, argv); }
