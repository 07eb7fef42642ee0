C     All calls of a step of contact one by one, in the manner of Fortran 77
C     (an example by one call is host_77.f): plane trusses of point masses
C     and bars in common blocks, multipliers as unknowns of a Gaussian
C     elimination. A truss of 2 cells falls on one of 4 cells, which is
C     clamped at its lower row. Calls are marked by C-EM.
C
C     It prints, for each of the three contact formulations:
C     steps, steps in contact, relative drift of the energy, smallest
C     gap, vertical velocity of the falling truss before and after.
C
      PROGRAM HOST
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      DO 10 IFORM = 1, 3
         CALL MESH
         CALL CONTCT(IFORM)
         CALL RUN(IFORM)
   10 CONTINUE
      END
C
C     Nodes, bars, masses, velocities, held freedoms.
C
      SUBROUTINE MESH
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXB=100)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /BARS/ EA, IBAR(2,MAXB), NBAR
      EA = 50.D0
      NNODE = 0
      NBAR = 0
      CALL STRIP(4, -2.D0, -1.D0, 1.D0, 0.D0, 0.D0)
      CALL STRIP(2, -0.875D0, 0.125D0, 1.D0, 0.25D0, -1.D0)
      DO 10 I = 1, NNODE
         IHELD(1,I) = 0
         IHELD(2,I) = 0
         IF (I.LE.5) THEN
            IHELD(1,I) = 1
            IHELD(2,I) = 1
         END IF
   10 CONTINUE
      END
C
C     A strip of N square cells with both diagonals, lower row first.
C
      SUBROUTINE STRIP(N, XLOW, YLOW, A, VX, VY)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXB=100)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      N0 = NNODE
      DO 20 J = 0, 1
         DO 10 I = 0, N
            NNODE = NNODE + 1
            X(1,NNODE) = XLOW + A*I
            X(2,NNODE) = YLOW + A*J
            U(1,NNODE) = 0.D0
            U(2,NNODE) = 0.D0
            V(1,NNODE) = VX
            V(2,NNODE) = VY
            AMASS(NNODE) = 1.D0
   10    CONTINUE
   20 CONTINUE
      M = N + 1
      DO 30 I = 1, M
         CALL BAR(N0 + I, N0 + M + I)
         IF (I.EQ.M) GOTO 30
         CALL BAR(N0 + I, N0 + I + 1)
         CALL BAR(N0 + M + I, N0 + M + I + 1)
         CALL BAR(N0 + I, N0 + M + I + 1)
         CALL BAR(N0 + I + 1, N0 + M + I)
   30 CONTINUE
      END
C
      SUBROUTINE BAR(I, J)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXB=100)
      COMMON /BARS/ EA, IBAR(2,MAXB), NBAR
      NBAR = NBAR + 1
      IBAR(1,NBAR) = I
      IBAR(2,NBAR) = J
      END
C
C-EM  The interface: upper row of the lower truss, from right to left,
C-EM  lower row of the upper one, from left to right: the bodies are to
C-EM  the left of their edges. The handle stands in a common block too.
C
      SUBROUTINE CONTCT(IFORM)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXK=10)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /CONTAC/ ALAM(MAXK), IH(3), IACT(MAXK), NCON
      DIMENSION LOWER(2,4), IUPPER(2,2), IOPT(5), ANGLE(2)
      DATA LOWER /10,9, 9,8, 8,7, 7,6/
      DATA IUPPER /11,12, 12,13/
      DATA IOPT /5*0/, ANGLE /2*0.D0/
      CALL EMNEW(IH, 2, NNODE, X, IERR)
      CALL CHECK(IERR)
      CALL EMSURF(IH, 4, LOWER, MASTER, IERR)
      CALL CHECK(IERR)
      CALL EMSURF(IH, 2, IUPPER, ISLAVE, IERR)
      CALL CHECK(IERR)
      CALL EMPAIR(IH, ISLAVE, MASTER, IFORM, IOPT, ANGLE, IERR)
      CALL CHECK(IERR)
      CALL EMPREP(IH, NNODE, IHELD, X, NCON, IERR)
      CALL CHECK(IERR)
      DO 10 I = 1, NCON
         IACT(I) = 0
   10 CONTINUE
      END
C
C     Errors of the library end this code, in its own way.
C
      SUBROUTINE CHECK(IERR)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXK=10)
      COMMON /CONTAC/ ALAM(MAXK), IH(3), IACT(MAXK), NCON
      CHARACTER*200 TEXT
      IF (IERR.EQ.0) RETURN
      CALL EMMSG(IH, 200, TEXT)
      WRITE (*,'(1X,A,I2,2A)') 'CONTACT: ERROR', IERR, ': ', TEXT
      STOP 1
      END
C
C     March through time, and print what came out.
C
      SUBROUTINE RUN(IFORM)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXK=10, NSTEP=400)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /CONTAC/ ALAM(MAXK), IH(3), IACT(MAXK), NCON
      H = 0.01D0
      E0 = ENERGY()
      V0 = V(2,12)
      DRIFT = 0.D0
      GMIN = 1.D30
      NTOUCH = 0
      DO 20 ISTEP = 1, NSTEP
         CALL STEP(H, GAP)
         DRIFT = MAX(DRIFT, ABS(ENERGY() - E0)/E0)
         GMIN = MIN(GMIN, GAP)
         NOW = 0
         DO 10 I = 1, NCON
            IF (IACT(I).EQ.1) NOW = 1
   10    CONTINUE
         NTOUCH = NTOUCH + NOW
   20 CONTINUE
      V1 = 0.D0
      DO 30 I = 11, 16
         V1 = V1 + V(2,I)/6.D0
   30 CONTINUE
      WRITE (*,'(3(1X,I4),4(1X,1PE13.5))') IFORM, NSTEP, NTOUCH, DRIFT,
     +   GMIN, V0, V1
      CALL EMFREE(IH)
      END
C
C     Kinetic energy, and EA L e**2/2 of each bar, e the strain.
C
      DOUBLE PRECISION FUNCTION ENERGY()
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXB=100)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /BARS/ EA, IBAR(2,MAXB), NBAR
      DIMENSION DU(2,MAXN)
      DO 10 I = 1, NNODE
         DU(1,I) = 0.D0
         DU(2,I) = 0.D0
   10 CONTINUE
      ENERGY = 0.D0
      DO 20 I = 1, NNODE
         ENERGY = ENERGY + 0.5D0*AMASS(I)*(V(1,I)**2 + V(2,I)**2)
   20 CONTINUE
      DO 30 K = 1, NBAR
         CALL STRAIN(K, DU, AL, E0, E1)
         ENERGY = ENERGY + 0.5D0*EA*AL*E0**2
   30 CONTINUE
      END
C
C     Length of bar K, and (l**2 - L**2)/(2 L**2) at the start and at
C     the end of a step.
C
      SUBROUTINE STRAIN(K, DU, AL, E0, E1)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXB=100)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /BARS/ EA, IBAR(2,MAXB), NBAR
      DIMENSION DU(2,MAXN)
      I = IBAR(1,K)
      J = IBAR(2,K)
      SQ = 0.D0
      E0 = 0.D0
      E1 = 0.D0
      DO 10 M = 1, 2
         A = X(M,J) - X(M,I)
         B0 = U(M,J) - U(M,I)
         B1 = B0 + (DU(M,J) - DU(M,I))
         SQ = SQ + A**2
         E0 = E0 + (A + 0.5D0*B0)*B0
         E1 = E1 + (A + 0.5D0*B1)*B1
   10 CONTINUE
      AL = SQRT(SQ)
      E0 = E0/SQ
      E1 = E1/SQ
      END
C
C     Residual R, tangent TAN of an energy-momentum step by DU, and the
C     sizes AMAG of what the residual is made of. Bars pull with the
C     mean of the stresses at both ends of the step, along their
C     direction in the middle: with this the energy is kept.
C
      SUBROUTINE FORCES(H, DU, R, TAN, AMAG, LD)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXB=100)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /BARS/ EA, IBAR(2,MAXB), NBAR
      DIMENSION DU(2,MAXN), R(2,MAXN), TAN(LD,LD), AMAG(2,MAXN)
      DIMENSION AM(2), A1(2)
      DO 20 J = 1, 2*NNODE
         DO 10 I = 1, 2*NNODE
            TAN(I,J) = 0.D0
   10    CONTINUE
   20 CONTINUE
      DO 40 I = 1, NNODE
         DO 30 M = 1, 2
            VM = DU(M,I)/H
            R(M,I) = AMASS(I)*(VM - V(M,I))*2.D0/H
            AMAG(M,I) = AMASS(I)*(ABS(VM) + ABS(V(M,I)))*2.D0/H
            TAN(2*I - 2 + M, 2*I - 2 + M) = 2.D0*AMASS(I)/H**2
   30    CONTINUE
   40 CONTINUE
      DO 70 K = 1, NBAR
         I = IBAR(1,K)
         J = IBAR(2,K)
         CALL STRAIN(K, DU, AL, E0, E1)
         S = 0.5D0*EA*(E0 + E1)/AL
         DO 50 M = 1, 2
            A0 = (X(M,J) - X(M,I)) + (U(M,J) - U(M,I))
            A1(M) = A0 + (DU(M,J) - DU(M,I))
            AM(M) = A0 + 0.5D0*(DU(M,J) - DU(M,I))
            R(M,J) = R(M,J) + S*AM(M)
            R(M,I) = R(M,I) - S*AM(M)
            AMAG(M,I) = AMAG(M,I) + ABS(S*AM(M))
            AMAG(M,J) = AMAG(M,J) + ABS(S*AM(M))
   50    CONTINUE
         DO 65 N = 1, 2
            DO 60 M = 1, 2
               T = 0.5D0*EA/AL**3*AM(M)*A1(N)
               IF (M.EQ.N) T = T + 0.5D0*S
               II = 2*I - 2
               JJ = 2*J - 2
               TAN(II+M,II+N) = TAN(II+M,II+N) + T
               TAN(JJ+M,JJ+N) = TAN(JJ+M,JJ+N) + T
               TAN(II+M,JJ+N) = TAN(II+M,JJ+N) - T
               TAN(JJ+M,II+N) = TAN(JJ+M,II+N) - T
   60       CONTINUE
   65    CONTINUE
   70 CONTINUE
      END
C
C     One step of size H: Newton's method for a set of contacts, until
C     the set stands. GAP is the smallest gap at the end.
C
      SUBROUTINE STEP(H, GAP)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXK=10)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /CONTAC/ ALAM(MAXK), IH(3), IACT(MAXK), NCON
      DIMENSION DU(2,MAXN), AMAG(2,MAXN)
      DIMENSION IWAS(MAXK), NEAR(MAXK), G0(MAXK), G1(MAXK)
      DO 10 I = 1, NNODE
         DU(1,I) = H*V(1,I)
         DU(2,I) = H*V(2,I)
   10 CONTINUE
      DO 20 I = 1, NCON
         IWAS(I) = IACT(I)
   20 CONTINUE
C-EM
      CALL EMBEG(IH, NNODE, NCON, U, DU, IWAS, IACT, IERR)
      CALL CHECK(IERR)
   30 CONTINUE
      CALL EMSEL(IH, NNODE, NCON, U, DU, IACT, K, IERR)
      CALL CHECK(IERR)
      CALL NEWTON(H, DU, K, AMAG)
      CALL EMUPD(IH, NNODE, NCON, U, DU, K, ALAM, AMAG, IACT, IDONE,
     +   ISTAT, IERR)
      CALL CHECK(IERR)
      IF (IDONE.EQ.0) GOTO 30
      IF (ISTAT.NE.0) THEN
         WRITE (*,*) 'STEP FAILED', ISTAT
         STOP 1
      END IF
      CALL EMGAP(IH, NNODE, NCON, U, DU, NEAR, G0, G1, IERR)
      CALL CHECK(IERR)
      GAP = 1.D30
      DO 40 I = 1, NCON
         IF (NEAR(I).EQ.1) GAP = MIN(GAP, G1(I))
   40 CONTINUE
C
      DO 60 I = 1, NNODE
         DO 50 M = 1, 2
            U(M,I) = U(M,I) + DU(M,I)
            V(M,I) = 2.D0*DU(M,I)/H - V(M,I)
   50    CONTINUE
   60 CONTINUE
      END
C
C     Newton's method with the multipliers of K contacts as unknowns:
C
C        [ TAN - sum lam dG/dq   -G^T ] [ d DU ]     [ R - G^T lam ]
C        [ C                       0  ] [ d lam ] = - [ DEFECT      ]
C
      SUBROUTINE NEWTON(H, DU, K, AMAG)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (MAXN=40, MAXK=10, LD=2*MAXN+MAXK, MAXNZ=4000)
      COMMON /NODES/ X(2,MAXN), U(2,MAXN), V(2,MAXN), AMASS(MAXN),
     +   IHELD(2,MAXN), NNODE
      COMMON /CONTAC/ ALAM(MAXK), IH(3), IACT(MAXK), NCON
      COMMON /EQUATS/ A(LD,LD), B(LD), VAL(MAXNZ), G(MAXNZ), C(MAXNZ),
     +   IROW(2*MAXN+1), ICOL(MAXNZ)
      DIMENSION DU(2,MAXN), R(2,MAXN), AMAG(2,MAXN), DEFECT(MAXK),
     +   DGAP(MAXK)
      N = 2*NNODE
      SIZE = 0.D0
      DO 10 I = 1, NNODE
         SIZE = MAX(SIZE, ABS(X(1,I)), ABS(X(2,I)))
   10 CONTINUE
      DO 15 L = 1, K
         ALAM(L) = 0.D0
   15 CONTINUE
      DO 100 ITER = 1, 25
         CALL FORCES(H, DU, R, A, AMAG, LD)
C-EM     Rows of discrete gradients and of gradients at the end.
         CALL EMEVAL(IH, NNODE, K, U, DU, MAXNZ, NZ, IROW, ICOL, G, C,
     +      DEFECT, DGAP, IERR)
         CALL CHECK(IERR)
         DO 30 L = 1, K
            DO 20 J = 1, N + K
               A(N+L,J) = 0.D0
               A(J,N+L) = 0.D0
   20       CONTINUE
   30    CONTINUE
         DO 40 I = 1, N
            B(I) = -R(2 - MOD(I,2), (I+1)/2)
   40    CONTINUE
         DO 60 L = 1, K
            B(N+L) = -DEFECT(L)
            DO 50 IZ = IROW(L), IROW(L+1) - 1
               J = ICOL(IZ)
               A(N+L,J) = C(IZ)
               A(J,N+L) = -G(IZ)
               B(J) = B(J) + G(IZ)*ALAM(L)
   50       CONTINUE
   60    CONTINUE
C-EM     Their derivatives.
         CALL EMCURV(IH, K, ALAM, MAXNZ, NZ, IROW, ICOL, VAL, IERR)
         CALL CHECK(IERR)
         DO 75 I = 1, N
            DO 70 IZ = IROW(I), IROW(I+1) - 1
               A(I,ICOL(IZ)) = A(I,ICOL(IZ)) - VAL(IZ)
   70       CONTINUE
   75    CONTINUE
         DO 85 I = 1, N
            IF (IHELD(2 - MOD(I,2), (I+1)/2).EQ.0) GOTO 85
            DO 80 J = 1, N + K
               A(I,J) = 0.D0
               A(J,I) = 0.D0
   80       CONTINUE
            A(I,I) = 1.D0
            B(I) = 0.D0
   85    CONTINUE
         CALL GAUSS(A, B, N + K, LD)
         DMAX = 0.D0
         DO 90 I = 1, N
            M = 2 - MOD(I,2)
            DU(M,(I+1)/2) = DU(M,(I+1)/2) + B(I)
            DMAX = MAX(DMAX, ABS(B(I)))
   90    CONTINUE
         DO 95 L = 1, K
            ALAM(L) = ALAM(L) + B(N+L)
   95    CONTINUE
         IF (DMAX.LE.1.D-12*SIZE) RETURN
  100 CONTINUE
      WRITE (*,*) 'NO CONVERGENCE', DMAX
      STOP 1
      END
C
C     Gaussian elimination with row pivots; B becomes the solution.
C
      SUBROUTINE GAUSS(A, B, N, LD)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      DIMENSION A(LD,LD), B(LD)
      DO 50 K = 1, N
         IP = K
         DO 10 I = K + 1, N
            IF (ABS(A(I,K)).GT.ABS(A(IP,K))) IP = I
   10    CONTINUE
         DO 20 J = K, N
            T = A(K,J)
            A(K,J) = A(IP,J)
            A(IP,J) = T
   20    CONTINUE
         T = B(K)
         B(K) = B(IP)
         B(IP) = T
         DO 40 I = K + 1, N
            F = A(I,K)/A(K,K)
            DO 30 J = K + 1, N
               A(I,J) = A(I,J) - F*A(K,J)
   30       CONTINUE
            B(I) = B(I) - F*B(K)
   40    CONTINUE
   50 CONTINUE
      DO 70 I = N, 1, -1
         DO 60 J = I + 1, N
            B(I) = B(I) - A(I,J)*B(J)
   60    CONTINUE
         B(I) = B(I)/A(I,I)
   70 CONTINUE
      END
