/* Interface to sequential MUMPS for one real or complex matrix. */
#include <dmumps_c.h>
#include <zmumps_c.h>
#include <malloc.h>
#include <string.h>

void openblas_set_num_threads(int);

void give_back(void) { malloc_trim(0); }

/* job: -1 begin, 1 analyze, 2 factorize, 3 solve, -2 end. */
#define DEFINE(PREFIX, STRUCT, NUMBER)                                                        \
    struct PREFIX##_run { STRUCT id; };                                                       \
    unsigned long PREFIX##_run_size(void) { return sizeof(struct PREFIX##_run); }             \
    int PREFIX##_run_begin(struct PREFIX##_run *run, int symmetric, int n, long long nnz,     \
                           int *rows, int *columns, NUMBER *values) {                         \
        memset(run, 0, sizeof *run);                                                          \
        openblas_set_num_threads(1);                                                          \
        run->id.job = -1;                                                                     \
        run->id.par = 1;                                                                      \
        run->id.sym = symmetric;                                                              \
        run->id.comm_fortran = -987654;                                                       \
        PREFIX##_c(&run->id);                                                                 \
        for (int i = 0; i < 4; i++) run->id.icntl[i] = i == 3 ? 0 : -1;                       \
        run->id.icntl[6] = 3; /* SCOTCH */                                                    \
        run->id.n = n;                                                                        \
        run->id.nnz = nnz;                                                                    \
        run->id.irn = rows;                                                                   \
        run->id.jcn = columns;                                                                \
        run->id.a = values;                                                                   \
        run->id.job = 1;                                                                      \
        PREFIX##_c(&run->id);                                                                 \
        return run->id.infog[0];                                                              \
    }                                                                                         \
    int PREFIX##_run_factor(struct PREFIX##_run *run) {                                       \
        run->id.job = 2;                                                                      \
        PREFIX##_c(&run->id);                                                                 \
        return run->id.infog[0];                                                              \
    }                                                                                         \
    int PREFIX##_run_solve(struct PREFIX##_run *run, NUMBER *rhs) {                           \
        run->id.rhs = rhs;                                                                    \
        run->id.nrhs = 1;                                                                     \
        run->id.lrhs = run->id.n;                                                             \
        run->id.job = 3;                                                                      \
        PREFIX##_c(&run->id);                                                                 \
        return run->id.infog[0];                                                              \
    }                                                                                         \
    /* Memory used, in megabytes. */                                                          \
    int PREFIX##_run_memory(struct PREFIX##_run *run) { return run->id.infog[21]; }           \
    /* Entries of the factors; a negative value is in millions. */                            \
    int PREFIX##_run_entries(struct PREFIX##_run *run) { return run->id.infog[28]; }          \
    void PREFIX##_run_end(struct PREFIX##_run *run) {                                         \
        run->id.job = -2;                                                                     \
        PREFIX##_c(&run->id);                                                                 \
    }

DEFINE(dmumps, DMUMPS_STRUC_C, double)
DEFINE(zmumps, ZMUMPS_STRUC_C, mumps_double_complex)
